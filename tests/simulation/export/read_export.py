#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Reads a FEBio (.feb) or SOFA (.scn) file as its manual says it is to be read, puts our answer in and sums the forces.

    read_export.py FILE DISPLACEMENT.csv BOUND

The neo-Hookean of both manuals is W = mu/2 (I1 - 3) - mu ln J + lambda/2 ln^2 J. The answer of the breast's nodes is given;
an apex of the skin stands where its tetrahedron is free of normal stress. Prints the largest force out of balance over
the largest nodal load; exit 1 when it is above BOUND. Standard library alone.
"""

import csv
import math
import sys
import xml.etree.ElementTree as ElementTree


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def transpose(m):
    return [list(row) for row in zip(*m)]


def multiply(a, b):
    columns = transpose(b)
    return [[dot(row, column) for column in columns] for row in a]


def determinant(m):
    return dot(m[0], cross(m[1], m[2]))


def inverse(m):
    d = determinant(m)
    columns = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])]
    return transpose([[x / d for x in column] for column in columns])


def edges(points):
    return transpose([sub(points[k], points[0]) for k in (1, 2, 3)])


def neo_hookean(f, mu, lam):
    """First Piola-Kirchhoff stress."""
    g, log_j = transpose(inverse(f)), math.log(determinant(f))
    return [[mu * f[i][j] + (lam * log_j - mu) * g[i][j] for j in range(3)] for i in range(3)]


def corotational(f, mu, lam):
    r = f
    for _ in range(100):
        g = transpose(inverse(r))
        r = [[0.5 * (r[i][j] + g[i][j]) for j in range(3)] for i in range(3)]
    strain = multiply(transpose(r), f)
    trace = sum(strain[i][i] - 1 for i in range(3))
    return [[2 * mu * (f[i][j] - r[i][j]) + lam * trace * r[i][j] for j in range(3)] for i in range(3)]


def lame(young, nu):
    return young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))


class Model:
    """points (of node), tetrahedra (nodes, law, mu, lambda), springs (weights of degrees, k, rest), loads, held."""

    def __init__(self):
        self.points, self.cells, self.springs, self.loads, self.held, self.skin = {}, [], [], {}, set(), set()


def ids(text):
    return [int(word) for word in text.replace(",", " ").split()]


def floats(text):
    return [float(word) for word in text.replace(",", " ").split()]


def read_febio(root):
    assert root.tag == "febio_spec" and root.get("version") == "4.0"
    order = ["Module", "Control", "Material", "Mesh", "MeshDomains", "MeshData", "Boundary", "Loads", "Discrete",
             "LoadData", "Output"]
    assert [child.tag for child in root] == [tag for tag in order if root.find(tag) is not None]
    model, mesh = Model(), root.find("Mesh")
    materials = {m.get("name"): lame(float(m.findtext("E")), float(m.findtext("v"))) for m in root.find("Material")}
    assert all(m.get("type") == "neo-Hookean" for m in root.find("Material"))
    for expected, node in enumerate(mesh.find("Nodes"), 1):
        assert int(node.get("id")) == expected
        model.points[expected] = floats(node.text)
    domain = {d.get("name"): d.get("mat") for d in root.find("MeshDomains")}
    for part in mesh.findall("Elements"):
        assert part.get("type") == "tet4"
        for element in part:
            nodes = ids(element.text)
            model.cells.append((nodes, neo_hookean, *materials[domain[part.get("name")]]))
            if part.get("name") == "skin":
                model.skin.add(nodes[3])
    sets = {s.get("name"): ids(s.text) for s in mesh.findall("NodeSet")}
    for bc in root.find("Boundary"):
        if bc.get("type") == "zero displacement":
            axes = [k for k, axis in enumerate("xyz") if bc.findtext(f"{axis}_dof") == "1"]
            model.held |= {(n, k) for n in sets[bc.get("node_set")] for k in axes}
        else:
            assert bc.get("type") == "linear constraint" and bc.findtext("dof") == "x"
            terms = [(int(c.findtext("node")), "xyz".index(c.findtext("dof")), float(c.findtext("value")))
                     for c in bc.findall("child_dof")]
            model.springs.append((int(bc.findtext("node")), terms))
    if root.find("Discrete") is not None:
        stiffness = float(root.find("Discrete/discrete_material/E").text)
        ends = [ids(d.text) for d in mesh.find("DiscreteSet")]
        assert [node for node, _ in model.springs] == [end[0] for end in ends]
        assert all((end[1], k) in model.held for end in ends for k in range(3))
        model.springs = [(terms, stiffness, 0.0) for _, terms in model.springs]
    breast = sets[root.find("Loads/nodal_load").get("node_set")]
    for node in root.find("MeshData/NodeData"):
        model.loads[breast[int(node.get("lid")) - 1]] = floats(node.text)
    return model


def triples(text):
    numbers = floats(text)
    return [numbers[i:i + 3] for i in range(0, len(numbers), 3)]


def tets_of(node):
    numbers = ids(node.find("TetrahedronSetTopologyContainer").get("tetrahedra"))
    return [[n + 1 for n in numbers[i:i + 4]] for i in range(0, len(numbers), 4)]


def read_sofa_field(node):
    hyper, law = node.find("TetrahedronHyperelasticityFEMForceField"), node.find("TetrahedronFEMForceField")
    cells = tets_of(node)
    if hyper is not None:
        assert hyper.get("materialName") == "NeoHookean"
        return [(nodes, neo_hookean, *floats(hyper.get("ParameterSet"))) for nodes in cells]
    assert law.get("method") == "svd"
    young = floats(law.get("youngModulus"))
    young = young if len(young) > 1 else young * len(cells)
    return [(nodes, corotational, *lame(e, float(law.get("poissonRatio")))) for nodes, e in zip(cells, young)]


def read_sofa(root):
    model = Model()
    breast = root.find("Node[@name='breast']")
    for n, p in enumerate(triples(breast.find("MechanicalObject").get("position")), 1):
        model.points[n] = p
    for name in ("tissue", "skin"):
        part = breast.find(f"Node[@name='{name}']")
        if part is not None:
            model.cells += read_sofa_field(part)
            if name == "skin":
                model.skin |= {nodes[3] for nodes in tets_of(part)}
    load = breast.find("ConstantForceField")
    model.loads = {n + 1: f for n, f in zip(ids(load.get("indices")), triples(load.get("forces")))}
    fixed = breast.find("FixedProjectiveConstraint")
    if fixed is not None:
        model.held = {(n + 1, k) for n in ids(fixed.get("indices")) for k in range(3)}
    springs = breast.find("Node[@name='springs']")
    if springs is not None:
        points = triples(springs.find("MechanicalObject").get("position"))
        anchors = triples(root.find("Node[@name='anchors']/MechanicalObject").get("position"))
        faces = faces_at(model, points)
        numbers = floats(springs.find("SpringForceField").get("spring"))
        for s in range(0, len(numbers), 5):
            i, j, stiffness, _, length = numbers[s:s + 5]
            towards = sub(points[int(j)], anchors[int(i)])
            size = math.sqrt(dot(towards, towards))
            terms = [(node, k, weight * towards[k] / size) for node, weight in faces[int(j)] for k in range(3)]
            model.springs.append((terms, stiffness, length - size))
    return model


def square(number):
    return math.floor(number / 15)


def faces_at(model, points):
    """Barycentric weights of points that lie in tetrahedra, as BarycentricMapping finds them."""
    boxes = {}
    for nodes, *_ in model.cells:
        if nodes[3] in model.skin:
            continue
        corners = [model.points[n] for n in nodes]
        reach = [range(square(min(c) - 1e-6), square(max(c) + 1e-6) + 1) for c in zip(*corners)]
        entry = nodes, corners[0], inverse(edges(corners))
        for key in ((i, j, k) for i in reach[0] for j in reach[1] for k in reach[2]):
            boxes.setdefault(key, []).append(entry)
    found, known = [], {}
    for p in points:
        key = tuple(round(x, 6) for x in p)
        if key not in known:
            best = None
            for nodes, origin, to_local in boxes.get(tuple(square(x) for x in p), []):
                local = [dot(row, sub(p, origin)) for row in to_local]
                weights = [1 - sum(local)] + local
                if best is None or min(weights) > min(w for _, w in best):
                    best = list(zip(nodes, weights))
            assert best is not None and min(w for _, w in best) > -1e-6, f"a spring at {p} hangs on nothing"
            known[key] = best
        found.append(known[key])
    return found


def place_apexes(model, x):
    """Where the skin's tetrahedra carry no stress across: along the deformed normal, at the stretch that frees it."""
    for nodes, law, mu, lam in model.cells:
        if nodes[3] not in model.skin:
            continue
        a, b, c, d = (model.points[n] for n in nodes)
        normal = cross(sub(b, a), sub(c, a))
        height = dot(sub(d, a), normal) / math.sqrt(dot(normal, normal))
        p, q, r = (x[n] for n in nodes[:3])
        now = cross(sub(q, p), sub(r, p))
        area_ratio = math.sqrt(dot(now, now) / dot(normal, normal))
        low, high = 1e-3, 1e3
        for _ in range(200):
            t = math.sqrt(low * high)
            if law is neo_hookean:
                push = mu * (t * t - 1) + lam * math.log(area_ratio * t)
            else:
                in_plane = [p0 - 1 for p0 in principal_stretches(sub(b, a), sub(c, a), sub(q, p), sub(r, p))]
                push = 2 * mu * (t - 1) + lam * (sum(in_plane) + t - 1)
            low, high = (low, t) if push > 0 else (t, high)
        middle = [sum(v) / 3 for v in zip(p, q, r)]
        x[nodes[3]] = [m + height * t * n / math.sqrt(dot(now, now)) for m, n in zip(middle, now)]


def principal_stretches(e1, e2, f1, f2):
    g = [[dot(e1, e1), dot(e1, e2)], [dot(e1, e2), dot(e2, e2)]]
    h = [[dot(f1, f1), dot(f1, f2)], [dot(f1, f2), dot(f2, f2)]]
    det = g[0][0] * g[1][1] - g[0][1] ** 2
    trace = (g[1][1] * h[0][0] - 2 * g[0][1] * h[0][1] + g[0][0] * h[1][1]) / det
    product = (h[0][0] * h[1][1] - h[0][1] ** 2) / det
    root = math.sqrt(max(0.25 * trace * trace - product, 0))
    return [math.sqrt(0.5 * trace + root), math.sqrt(0.5 * trace - root)]


def out_of_balance(model, x):
    force = {n: [0.0, 0.0, 0.0] for n in model.points}
    for nodes, law, mu, lam in model.cells:
        before = edges([model.points[n] for n in nodes])
        f = multiply(edges([x[n] for n in nodes]), inverse(before))
        volume = determinant(before) / 6
        assert volume > 0
        b = transpose(inverse(before))
        stress = multiply(law(f, mu, lam), b)
        for a in (1, 2, 3):
            for k in range(3):
                force[nodes[a]][k] += volume * stress[k][a - 1]
                force[nodes[0]][k] -= volume * stress[k][a - 1]
    for terms, stiffness, rest in model.springs:
        pull = stiffness * (sum(w * (x[n][k] - model.points[n][k]) for n, k, w in terms) - rest)
        for n, k, w in terms:
            force[n][k] += pull * w
    for n, load in model.loads.items():
        force[n] = sub(force[n], load)
    used = {n for nodes, *_ in model.cells for n in nodes}
    return max(abs(force[n][k]) for n in used for k in range(3) if (n, k) not in model.held)


def main():
    root = ElementTree.parse(sys.argv[1]).getroot()
    model = read_febio(root) if root.tag == "febio_spec" else read_sofa(root)
    x = {n: list(p) for n, p in model.points.items()}
    with open(sys.argv[2]) as table:
        for row in csv.DictReader(table):
            n = int(row["node"])
            x[n] = [p + float(row[key]) for p, key in zip(model.points[n], ("ux_mm", "uy_mm", "uz_mm"))]
    place_apexes(model, x)
    largest = max(abs(v) for load in model.loads.values() for v in load)
    share = out_of_balance(model, x) / largest
    print(f"{len(model.cells)} tetrahedra, {len(model.skin)} of them skin, {len(model.springs)} springs; "
          f"out of balance: {share:.2e} of the largest nodal load")
    return 0 if share <= float(sys.argv[3]) else 1


if __name__ == "__main__":
    sys.exit(main())
