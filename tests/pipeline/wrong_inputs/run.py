#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Wrong inputs to the built tools: run.py BIN RUN [TABLE ...] [--only WORDS] [--jobs N]

RUN is the finished run of the small case (tests/pipeline/small_case.h). Each row of a table is one wrong input, tried on a copy of it:

    tool | what is changed | exit code | words that the message (of 0: or standard output) must hold, parted by ;

A tool must end with the code, say `supine-TOOL: error: ` with every word on standard error, and leave no file that was not there.
README.md says how changes are written.
"""
import argparse
import concurrent.futures
import gzip
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
SAMPLES = HERE.parents[2] / "samples" / "silicone_bar"
LONGEST_S = 120

# The command line of each tool; CASE and OUT are the copy's.
COMMANDS = {
    "segment": "{case} -o {out}/labels.vti",
    "reconstruct": "{out}/labels.vti -o {out}",
    "decimate": "{out}/breast.vtp --triangles 800 --max-distance-mm 2 -o {out}/coarse.vtp",
    "tetrahedralise": "{out}/coarse.vtp {out}/muscle.vtp {out}/labels.vti -o {out}/mesh.vtu",
    "simulate": "{case} {out}/mesh.vtu --model {case}/model.toml -o {out}",
    "compare": "{case} {out}/supine.vtu -o {out}",
    "calibrate": "{case} {out}/mesh.vtu --model {case}/model.toml -o {out}/fitted",
    "sensitivity": "{case} {out}/mesh.vtu --model {case}/model.toml --samples 10 -o {out}/drawn",
    "diagnose": "{case} {out}/mesh.vtu --model {case}/model.toml -o {out}/diagnosed",
    "targets": "{case} {out}/mesh.vtu --no-other-meshes --no-further-scans -o {out}/found",
    "register": "{case} --shape {out}/supine.vtu -o {out}/placed",
    "model": "show {case}/model.toml",
    "report": "{case} --dir {out} -o {out}/report.html",
    "phantom": "-o {case}/made",
    "warp": "{case} -o {out}/carried",
    "cohort": "{case}/many -o {out}/pooled",
}


# The same of a body that is no breast: rows of the tables that begin with `object`.
OBJECT_COMMANDS = COMMANDS | {
    "reconstruct": "{case} -o {out}",
    "tetrahedralise": "{out}/coarse.vtp {out}/muscle.vtp --case {case} --order 1 -o {out}/mesh.vtu",
    "compare": "{case} {out}/hanging.vtu -o {out}",
    "register": "{case} --pose hanging --shape {out}/hanging.vtu -o {out}/placed",
}
BREAST_FILES, OBJECT_FILES = ("case.toml", "model.toml", "labels.nrrd", "supine.ply"), ("case.toml", "model.toml", "bar.obj", "scan.ply", "outline.ply")


class BadRow(Exception):
    pass


def quoted(text):
    """The strings in double quotes, with \\n and \\" as in TOML."""
    return [m.encode().decode("unicode_escape") for m in re.findall(r'"((?:[^"\\]|\\.)*)"', text)]


def replace(data, argument):
    old, new = (text.encode() for text in quoted(argument))
    if old not in data:
        raise BadRow(f"there is no {old!r} to replace")
    return data.replace(old, new, 1)


def map_points(data, argument):
    """Each vertex of an ASCII PLY, or each row of a table of landmarks, through three expressions of x, y and z."""
    program = compile(f"({argument})", "map", "eval")
    lines, table = data.decode().split("\n"), not data.startswith(b"ply")
    first = 1 if table else lines.index("end_header") + 1
    count = len(lines) - 1 if table else int(re.search(r"element vertex (\d+)", data.decode()).group(1))
    for row in range(first, first + count):
        words = lines[row].split("," if table else " ") if row < len(lines) else []
        if len(words) < 3:
            break
        at = 1 if table else 0
        x, y, z = (float(word) for word in words[at:at + 3])
        words[at:at + 3] = [repr(float(value)) for value in eval(program, {"x": x, "y": y, "z": z})]
        lines[row] = ("," if table else " ").join(words)
    return "\n".join(lines).encode()


CHANGES = {
    "replace": replace,
    "append": lambda data, argument: data + quoted(argument)[0].encode(),
    "text": lambda data, argument: quoted(argument)[0].encode(),
    "cut": lambda data, argument: data[:int(len(data) * float(argument.rstrip("%")) / 100)],
    "invert": lambda data, argument: data[:int(argument)] + bytes(255 - b for b in data[int(argument):int(argument) + 8]) + data[int(argument) + 8:],
    "bytes": lambda data, argument: quoted(argument)[0].encode("latin-1"),
    "before": lambda data, argument: quoted(argument)[0].encode("latin-1") + data,
    "gzip": lambda data, argument: gzip.compress(data, mtime=0),
    "crlf": lambda data, argument: data.replace(b"\n", b"\r\n"),
    "map": map_points,
}


def add_landmarks(folder):
    """Five landmarks on the skin of the small case in both poses, and the lines of case.toml that name them."""
    rows = {"prone": ["name,x,y,z"], "supine": ["name,x,y,z"]}
    for name, x, z in (("nipple", 0, 0), ("left", 20, 4), ("right", -22, 2), ("upper", 3, 24), ("lower", -4, -18)):
        height = 30 * (1 - (x * x + z * z) / 42**2)
        rows["prone"].append(f"{name},{x},{-9 - height:.3f},{z}")
        rows["supine"].append(f"{name},{x},{-9 - 0.75 * height:.3f},{z}")
    for pose, lines in rows.items():
        (folder / f"{pose}.csv").write_text("\n".join(lines) + "\n")
    case = (folder / "case.toml").read_text()
    case = case.replace('surface = "supine.ply"', 'surface = "supine.ply"\nlandmarks = "supine.csv"')
    (folder / "case.toml").write_text(case + '[landmarks]\nprone = "prone.csv"\n')


def change(folder, text, extra):
    """Does one change of a row to the copy in folder; options go into extra."""
    if text == "landmarks":
        return add_landmarks(folder)
    if text.startswith("option "):
        extra += text[7:].format(case=folder, out=folder / "out").split()
        return
    name, _, rest = text.partition(": ")
    verb, _, argument = rest.partition(" ")
    file = folder / name
    file.parent.mkdir(parents=True, exist_ok=True)
    if verb == "remove":
        return shutil.rmtree(file) if file.is_dir() else file.unlink()
    if verb == "link":
        file.unlink(missing_ok=True)
        return file.symlink_to(argument)
    if verb == "folder":
        file.unlink(missing_ok=True)
        return file.mkdir()
    if verb != "copy" and verb not in CHANGES:
        raise BadRow(f"no such change: {verb}")
    data = (folder / argument).read_bytes() if verb == "copy" else CHANGES[verb](file.read_bytes() if file.exists() else b"", argument)
    file.unlink(missing_ok=True)  # a link to the shared run, perhaps
    file.write_bytes(data)


def command_of(row, folder, binaries, extra):
    """The tool's command line; an option that the row gives takes the place of the usual one."""
    commands = OBJECT_COMMANDS if row["object"] else COMMANDS
    words = [word.format(case=folder, out=folder / "out") for word in commands[row["tool"]].split()]
    for option in (word for word in extra if word.startswith("-") and word in words):
        at = words.index(option)
        del words[at:at + 2]
    forced = [] if row["tool"] == "model" else ["--force"]
    return [str(binaries / f"supine-{row['tool']}"), *words, *extra, *forced, "--threads", "1"]


def contents(folder):
    return {path.relative_to(folder): (path.stat().st_size, path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file()}


def write_obj(stl, target):
    """A binary STL as an OBJ, whose lines can be changed one by one."""
    data = stl.read_bytes()
    rows, faces = {}, []
    for t in range(struct.unpack("<I", data[80:84])[0]):
        numbers = struct.unpack("<9f", data[96 + 50 * t:132 + 50 * t])
        faces.append([rows.setdefault(numbers[k:k + 3], len(rows) + 1) for k in (0, 3, 6)])
    target.write_text("".join("v %r %r %r\n" % p for p in rows) + "".join("f %d %d %d\n" % tuple(f) for f in faces))


def make_object_run(binaries, folder):
    """The bar of two parts on a coarse mesh of linear cells, and a contour of another bar."""
    case = (SAMPLES / "joined" / "case.toml").read_text()
    (folder / "case.toml").write_text(case.replace("../bar.stl", "bar.obj"))
    write_obj(SAMPLES / "bar.stl", folder / "bar.obj")
    for name, source in (("model.toml", "joined/model.toml"), ("scan.ply", "joined/scan.ply"), ("outline.ply", "moldstar/outline.ply")):
        shutil.copyfile(SAMPLES / source, folder / name)
    steps = {tool: OBJECT_COMMANDS[tool] for tool in ("reconstruct", "tetrahedralise", "simulate")}
    steps = {"reconstruct": steps["reconstruct"], "decimate": "{out}/breast.vtp --edge-mm 15 --sharp-deg 40 -o {out}/coarse.vtp"} | steps
    (folder / "out").mkdir()
    for tool, words in steps.items():
        command = [str(binaries / f"supine-{tool}"), *(w.format(case=folder, out=folder / "out") for w in words.split()), "--force", "--threads", "1"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder


def copy_run(run, folder, files):
    for name in files:
        shutil.copyfile(run / name, folder / name)
    (folder / "out").mkdir()
    for name in os.listdir(run / "out"):
        if (run / "out" / name).is_file():
            os.symlink(run / "out" / name, folder / "out" / name)


def try_row(row, binaries, run):
    """What is wrong with the tool's answer; empty: nothing."""
    with tempfile.TemporaryDirectory(prefix="supine-wrong-") as name:
        folder, extra = pathlib.Path(name), []
        copy_run(run, folder, OBJECT_FILES if row["object"] else BREAST_FILES)
        for text in row["changes"]:
            change(folder, text, extra)
        before = contents(folder)
        try:
            ended = subprocess.run(command_of(row, folder, binaries, extra), capture_output=True, timeout=LONGEST_S, cwd=folder)
        except subprocess.TimeoutExpired:
            return [f"did not end in {LONGEST_S} s"]
        message = ended.stderr.decode(errors="replace")
        wrong = []
        if ended.returncode != row["code"]:
            wrong.append(f"ended with {ended.returncode}, not {row['code']}")
        if row["code"] and f"supine-{row['tool']}: error: " not in message:
            wrong.append("says no error")
        told = message if row["code"] else message + ended.stdout.decode(errors="replace")
        wrong += [f"does not say '{word}'" for word in row["words"] if word not in told]
        if row["code"] in (2, 3) and contents(folder) != before:
            wrong.append(f"left {sorted(map(str, contents(folder).keys() - before.keys()))}")
        return wrong + [message.strip()] if wrong else []


def read_table(file):
    rows = []
    for number, line in enumerate(file.read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        cells = [cell.strip() for cell in line.split(" | ")]
        if len(cells) != 4:
            sys.exit(f"{file}:{number}: a row has four cells parted by ' | ', this one has {len(cells)}")
        rows.append({"where": f"{file.name}:{number}", "object": file.name.startswith("object"), "tool": cells[0], "changes": [c.strip() for c in cells[1].split(";;")],
                     "code": int(cells[2]), "words": [word.strip() for word in cells[3].split(";") if word.strip()]})
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("tables", type=pathlib.Path, nargs="*", help="default: every .txt beside this file")
    parser.add_argument("--only", default="", help="rows that hold this")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    rows = [row for table in given.tables or sorted(HERE.glob("*.txt")) for row in read_table(table) if given.only in str(row)]
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool, tempfile.TemporaryDirectory(prefix="supine-object-") as made:
        bar = make_object_run(given.bin.resolve(), pathlib.Path(made)) if any(row["object"] for row in rows) else None

        def judged(row):
            try:
                return try_row(row, given.bin.resolve(), bar if row["object"] else given.run.resolve())
            except (BadRow, OSError, ValueError, SyntaxError) as error:
                return [f"the row itself is wrong: {error}"]
        answers = list(pool.map(judged, rows))
    bad = 0
    for row, wrong in zip(rows, answers):
        if wrong:
            bad += 1
            print(f"{row['where']}: {row['tool']} | {' ;; '.join(row['changes'])}\n    " + "\n    ".join(wrong))
    print(f"{len(rows) - bad} of {len(rows)} wrong inputs are answered as the tables say")
    return 1 if bad or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
