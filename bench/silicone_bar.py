#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Cases made of those in samples/silicone_bar (docs/validation.md). Standard library alone.

    silicone_bar.py both SAMPLES FOLDER         both bars as one body: each at its own clamp, the second 100 mm in front
    silicone_bar.py scan OUT FILE SEED [KEY=NUMBER ...]
                                                a made scan of a simulated case (OUT/hanging.vtu), seen as the real ones:
                                                noise=0.6 shared=0.5 (1 sigma, mm), cell=6 (mm of contour that err alike,
                                                0: each point by itself), from=25 to=300 (mm from the clamp)
    silicone_bar.py uncover CASE FOLDER MM      the case without scan points nearer than MM to the clamp
    silicone_bar.py clamp CASE FOLDER KIND      the case with the held head in the mesh (bar_with_head.stl): KIND = held
                                                (its faces fixed) or a stiffness in kPa/mm (its faces on springs)
    silicone_bar.py picture OUT SCAN FILE       the scan (red) on the model's skin (grey) of OUT/hanging.vtu, x to the right, y up
"""
import pathlib
import random
import re
import shutil
import struct
import sys
import zlib

APART_MM = 100.0  # in z, toward the camera


def stl_triangles(path):
    data = path.read_bytes()
    count = struct.unpack("<I", data[80:84])[0]
    return [struct.unpack("<12f", data[84 + 50 * i:132 + 50 * i]) for i in range(count)]


def write_stl(path, header, triangles):
    body = b"".join(struct.pack("<12fH", *t, 0) for t in triangles)
    path.write_bytes(header.encode().ljust(80)[:80] + struct.pack("<I", len(triangles)) + body)


def shifted(triangle, dz):
    return triangle[:3] + tuple(v + (dz if k % 3 == 2 else 0) for k, v in enumerate(triangle[3:]))


def ply(path):
    """Header lines but the counts and properties, and the coordinates."""
    head, body = path.read_text().split("end_header\n")
    comments = [line for line in head.splitlines() if line.startswith("comment")]
    return comments, [tuple(map(float, line.split()[:3])) for line in body.splitlines() if line.strip()]


def write_ply(path, comments, points):
    rows = "".join(f"{x:.2f} {y:.2f} {z:.2f}\n" for x, y, z in points)
    path.write_text("ply\nformat ascii 1.0\n" + "".join(c + "\n" for c in comments) +
                    f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + rows)


def both(samples, folder):
    folder.mkdir(parents=True, exist_ok=True)
    bar = stl_triangles(samples / "bar.stl")
    write_stl(folder / "bars.stl", "two bars of DiffCal (github.com/diku-dk/DiffCal, GPL-3.0), mm",
              bar + [shifted(t, APART_MM) for t in bar])
    shutil.copy(samples / "ecoflex" / "outline.ply", folder / "ecoflex.ply")
    comments, points = ply(samples / "moldstar" / "outline.ply")
    write_ply(folder / "moldstar.ply", comments + [f"comment moved by {APART_MM:g} mm in z"],
              [(x, y, z + APART_MM) for x, y, z in points])


class Vtu:
    """What we write: appended raw data, zlib blocks with 32- or 64-bit heads."""

    def __init__(self, path):
        data = path.read_bytes()
        start = data.index(b'<AppendedData encoding="raw">')
        self.head, self.body = data[:start].decode(), data[data.index(b"_", start) + 1:]
        self.word = 8 if 'header_type="UInt64"' in self.head else 4

    def array(self, name):
        tag = re.search(rf'<DataArray type="(\w+)" Name="{name}"[^>]*offset="(\d+)"', self.head)
        kind, at = tag.group(1), int(tag.group(2))
        form = "<" + ("Q" if self.word == 8 else "I")
        read = lambda k: struct.unpack_from(form, self.body, at + k * self.word)[0]
        blocks, place, data = read(0), at + (3 + read(0)) * self.word, b""
        for b in range(blocks):
            data += zlib.decompress(self.body[place:place + read(3 + b)])
            place += read(3 + b)
        letter = {"Float64": "d", "Int64": "q", "Int32": "i", "UInt8": "B"}[kind]
        return struct.unpack(f"<{len(data) // struct.calcsize(letter)}{letter}", data)


SCAN = {"noise": 0.6, "shared": 0.5, "cell": 6.0, "from": 25.0, "to": 300.0}


def scan(out, target, seed, told):
    """Points of the upper, lower and end faces at all depths: noise along the normal that a cell of the contour has in
    common at every depth, and what points within 25 mm share."""
    said = SCAN | told
    vtu = Vtu(out / "hanging.vtu")
    numbers, moved = vtu.array("Points"), vtu.array("displacement_mm")
    points = [numbers[i:i + 3] for i in range(0, len(numbers), 3)]
    rest = [tuple(a - b for a, b in zip(p, moved[3 * i:3 * i + 3])) for i, p in enumerate(points)]
    nodes, ends, types = vtu.array("connectivity"), vtu.array("offsets"), vtu.array("types")
    dice, found = random.Random(seed), []
    common = {}
    for c, kind in enumerate(types):
        if kind not in (5, 22):  # triangles
            continue
        corner = nodes[ends[c - 1]:ends[c - 1] + 3]
        a, b, d = (rest[n] for n in corner)
        normal = cross(minus(b, a), minus(d, a))
        size = sum(x * x for x in normal) ** 0.5
        if abs(normal[2]) > 0.5 * size or not all(said["from"] <= -p[0] <= said["to"] for p in (a, b, d)):
            continue
        a, b, d = (points[n] for n in corner)
        normal = cross(minus(b, a), minus(d, a))
        length = sum(x * x for x in normal) ** 0.5
        for _ in range(max(1, round(size / 2 / 8))):
            s, t = sorted((dice.random(), dice.random()))
            at = [a[k] * s + b[k] * (t - s) + d[k] * (1 - t) for k in range(3)]
            shared = common.setdefault((round(at[0] / 25), round(at[1] / 25)), dice.gauss(0, said["shared"]))
            own = dice.gauss(0, said["noise"])
            if said["cell"] > 0:
                own = common.setdefault(("own", *(round(x / said["cell"]) for x in at[:2])), own)
            off = (shared + own) / length
            found.append(tuple(at[k] + off * normal[k] for k in range(3)))
    write_ply(target, ["comment made by bench/silicone_bar.py from a simulated bar", "comment unit mm"], found)


def picture(out, source, target, size=(1000, 760), box=(-185.0, 15.0, -137.0, 15.0)):
    """One pixel is 0.2 mm; skin triangles are drawn as their edges."""
    wide, high = size
    pixels = [bytearray(b"\xff" * 3 * wide) for _ in range(high)]

    def dot(x, y, colour, radius):
        i = int((x - box[0]) / (box[1] - box[0]) * wide)
        j = int((box[3] - y) / (box[3] - box[2]) * high)
        for v in range(max(0, j - radius), min(high, j + radius + 1)):
            for u in range(max(0, i - radius), min(wide, i + radius + 1)):
                pixels[v][3 * u:3 * u + 3] = bytes(colour)

    vtu = Vtu(out / "hanging.vtu")
    numbers, nodes, ends, types = (vtu.array(n) for n in ("Points", "connectivity", "offsets", "types"))
    for c, kind in enumerate(types):
        if kind not in (5, 22):  # triangles
            continue
        corner = nodes[ends[c - 1]:ends[c - 1] + 3]
        for k in range(3):
            a, b = (numbers[3 * n:3 * n + 2] for n in (corner[k], corner[(k + 1) % 3]))
            for s in range(60):
                dot(*(a[m] + (b[m] - a[m]) * s / 60 for m in range(2)), (190, 190, 190), 0)
    for x, y, _ in ply(source)[1]:
        dot(x, y, (200, 30, 30), 1)
    raw = b"".join(b"\0" + bytes(row) for row in pixels)
    chunk = lambda tag, data: struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))
    target.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", wide, high, 8, 2, 0, 0, 0)) +
                       chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def copy_case(case, folder):
    folder.mkdir(parents=True, exist_ok=True)
    text = (case / "case.toml").read_text().replace("../bar", str((case / "..").resolve() / "bar"))
    text = re.sub(r'surface = "([^"/]+)"', lambda m: f'surface = "{(case / m.group(1)).resolve()}"', text)
    shutil.copy(case / "model.toml", folder / "model.toml")
    return text


def uncover(case, folder, least_mm):
    text = copy_case(case, folder)
    source = pathlib.Path(re.search(r'surface = "([^"]+)"', text).group(1))
    comments, points = ply(source)
    write_ply(folder / "outline.ply", comments, [p for p in points if p[0] < -least_mm])
    (folder / "case.toml").write_text(text.replace(str(source), "outline.ply"))


def clamp(case, folder, kind):
    text = copy_case(case, folder).replace("bar.stl", "bar_with_head.stl")
    (folder / "case.toml").write_text(text.replace("normal = [1.0, 0.0, 0.0]\n", 'normal = [1.0, 0.0, 0.0]\nfaces = "beyond"\n', 1))
    if kind != "held":
        with open(folder / "model.toml", "a") as model:
            model.write(f'\n[supports.clamp]\nkind = "elastic"\nnormal_kpa_per_mm = {kind}\ntangential_kpa_per_mm = {kind}\n')


def main():
    words = sys.argv[1:]
    try:
        work, paths = words[0], [pathlib.Path(w) for w in words[1:3]]
        if len(paths) < 2:
            raise IndexError
        if work == "both":
            both(*paths)
        elif work == "scan":
            told = dict(word.split("=") for word in words[4:])
            if told.keys() - SCAN.keys():
                raise IndexError
            scan(*paths, int(words[3]), {key: float(value) for key, value in told.items()})
        elif work == "picture":
            picture(*paths, pathlib.Path(words[3]))
        elif work == "uncover":
            uncover(*paths, float(words[3]))
        elif work == "clamp":
            clamp(*paths, words[3])
        else:
            raise IndexError
    except IndexError:
        print(__doc__, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
