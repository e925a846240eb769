"""Vertices of animated glTF samples in the world at some moments, computed without vastlight.

    python3 poses.py FOLDER_OF_MODELS > poses.tsv

Plain Python in double precision, after the text of glTF 2.0. Rotations between keys go as q0 (q0^-1 q1)^t, which is another
formula than that of the importer.
"""

import base64
import json
import math
import struct
import sys
from pathlib import Path

# File, number of the animation, moments.
CASES = [
    ("BoxAnimated.glb", 0, [0.0, 0.6, 1.3, 2.9, 3.7083]),
    ("AnimatedMorphCube.glb", 0, [0.0, 0.51, 1.7, 3.3, 9.0]),
    ("AnimatedMorphSphere.glb", 0, [0.0, 1.1, 4.4]),
    ("SimpleMorph/SimpleMorph.gltf", 0, [0.0, 0.5, 1.25, 3.5]),
    ("SimpleSkin/SimpleSkin.gltf", 0, [0.0, 0.75, 2.2, 5.5]),
    ("RiggedSimple.glb", 0, [0.0, 0.6, 1.9]),
    ("RiggedFigure.glb", 0, [0.0, 0.4, 1.1]),
    ("Fox.glb", 0, [0.0, 1.7, 3.3]),
    ("Fox.glb", 1, [0.31, 0.7]),
    ("Fox.glb", 2, [0.5]),
    ("MorphStressTest.glb", 0, [0.7, 5.2]),
    ("MorphStressTest.glb", 1, [1.2]),
    ("MorphStressTest.glb", 2, [2.2]),
    ("RecursiveSkeletons.glb", 0, [0.35, 1.6]),
    *[("InterpolationTest.glb", i, [0.2, 0.9, 1.4, 1.69]) for i in range(9)],
]


def noted_vertices(name):
    return 1 if name == "InterpolationTest.glb" else 12

FORMATS = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Model:
    def __init__(self, path):
        data = path.read_bytes()
        binary = None
        if data[:4] == b"glTF":
            length = struct.unpack_from("<I", data, 12)[0]
            self.json = json.loads(data[20 : 20 + length])
            binary = data[20 + length + 8 :]
        else:
            self.json = json.loads(data)
        self.buffers = []
        for buffer in self.json["buffers"]:
            uri = buffer.get("uri")
            if uri is None:
                self.buffers.append(binary)
            elif uri.startswith("data:"):
                self.buffers.append(base64.b64decode(uri.split(",", 1)[1]))
            else:
                self.buffers.append((path.parent / uri).read_bytes())

    def elements(self, view, offset, kind, width, count):
        view = self.json["bufferViews"][view]
        size = struct.calcsize(kind) * width
        start = view.get("byteOffset", 0) + offset
        step = view.get("byteStride", size)
        data = self.buffers[view["buffer"]]
        return [list(struct.unpack_from(f"<{width}{kind}", data, start + i * step)) for i in range(count)]

    def read(self, index):
        accessor = self.json["accessors"][index]
        kind, width, count = FORMATS[accessor["componentType"]], WIDTHS[accessor["type"]], accessor["count"]
        values = [[0] * width for _ in range(count)]
        if "bufferView" in accessor:
            values = self.elements(accessor["bufferView"], accessor.get("byteOffset", 0), kind, width, count)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            at, new = sparse["indices"], sparse["values"]
            indices = self.elements(at["bufferView"], at.get("byteOffset", 0), FORMATS[at["componentType"]], 1, sparse["count"])
            changed = self.elements(new["bufferView"], new.get("byteOffset", 0), kind, width, sparse["count"])
            for (i,), value in zip(indices, changed):
                values[i] = value
        if accessor.get("normalized"):
            most = {"b": 127, "B": 255, "h": 32767, "H": 65535}[kind]
            values = [[max(x / most, -1.0) for x in value] for value in values]
        return values


def product(p, q):
    (a, b, c, d), (e, f, g, h) = p, q
    return [d * e + a * h + b * g - c * f, d * f - a * g + b * h + c * e, d * g + a * f - b * e + c * h, d * h - a * e - b * f - c * g]


def unit(q):
    length = math.sqrt(sum(x * x for x in q))
    return [x / length for x in q]


def between(p, q, t):
    p, q = unit(p), unit(q)
    way = product([-p[0], -p[1], -p[2], p[3]], q)
    if way[3] < 0:
        way = [-x for x in way]
    sine = math.sqrt(sum(x * x for x in way[:3]))
    if sine < 1e-12:
        return p
    half = math.atan2(sine, way[3]) * t
    return product(p, [x / sine * math.sin(half) for x in way[:3]] + [math.cos(half)])


def sample(model, sampler, path, time, width):
    times = [t for (t,) in model.read(sampler["input"])]
    flat = [x for value in model.read(sampler["output"]) for x in value]
    mode = sampler.get("interpolation", "LINEAR")
    rows = [flat[i : i + width] for i in range(0, len(flat), width)]
    values = rows[1::3] if mode == "CUBICSPLINE" else rows
    if time <= times[0]:
        found = values[0]
    elif time >= times[-1]:
        found = values[-1]
    else:
        k = max(i for i, t in enumerate(times) if t <= time)
        length = times[k + 1] - times[k]
        t = (time - times[k]) / length
        if mode == "STEP":
            found = values[k]
        elif mode == "CUBICSPLINE":
            start, leave, arrive, end = rows[3 * k + 1], rows[3 * k + 2], rows[3 * k + 3], rows[3 * k + 4]
            # Bezier's form of the same curve.
            points = [start, [v + length * b / 3 for v, b in zip(start, leave)], [v - length * a / 3 for v, a in zip(end, arrive)], end]
            while len(points) > 1:
                points = [[x + (y - x) * t for x, y in zip(p, q)] for p, q in zip(points, points[1:])]
            found = points[0]
        elif path == "rotation":
            return between(values[k], values[k + 1], t)
        else:
            found = [x + (y - x) * t for x, y in zip(values[k], values[k + 1])]
    return unit(found) if path == "rotation" else found


def times_matrix(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def columns(numbers):
    return [[numbers[4 * c + r] for c in range(4)] for r in range(4)]


def local(node):
    if "matrix" in node:
        return columns(node["matrix"])
    x, y, z, w = unit(node.get("rotation", [0, 0, 0, 1]))
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    scale, move = node.get("scale", [1, 1, 1]), node.get("translation", [0, 0, 0])
    return [[turn[i][j] * scale[j] for j in range(3)] + [move[i]] for i in range(3)] + [[0, 0, 0, 1]]


def apply(m, p):
    return [m[i][0] * p[0] + m[i][1] * p[1] + m[i][2] * p[2] + m[i][3] for i in range(3)]


def target_count(document, node):
    return len(document["meshes"][node["mesh"]]["primitives"][0].get("targets", []))


def posed_nodes(model, animation, time):
    nodes = [dict(node) for node in model.json["nodes"]]
    animation = model.json["animations"][animation]
    for channel in animation["channels"]:
        node, path = channel["target"].get("node"), channel["target"]["path"]
        if node is None:
            continue
        width = {"translation": 3, "rotation": 4, "scale": 3}.get(path) or target_count(model.json, nodes[node])
        nodes[node][path] = sample(model, animation["samplers"][channel["sampler"]], path, time, width)
    return nodes


def world(nodes, roots):
    """Node numbers in the order in which a walk meets them, with their matrices."""
    found, stack = {}, [(root, columns([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])) for root in reversed(roots)]
    while stack:
        number, above = stack.pop()
        found[number] = times_matrix(above, local(nodes[number]))
        stack += [(child, found[number]) for child in reversed(nodes[number].get("children", []))]
    return found


def spread(count, some):
    return sorted({count * (2 * i + 1) // (2 * some) for i in range(some)})


def rows(model, animation, time, some):
    nodes = posed_nodes(model, animation, time)
    document = model.json
    matrices = world(nodes, document["scenes"][document.get("scene", 0)]["nodes"])
    shown = [number for number in matrices if "mesh" in nodes[number]]
    for instance, number in enumerate(shown):
        node = nodes[number]
        mesh = document["meshes"][node["mesh"]]
        weights = node.get("weights", mesh.get("weights", []))
        first = 0
        for primitive in mesh["primitives"]:
            positions = model.read(primitive["attributes"]["POSITION"])
            noted = spread(len(positions), some) if instance < 12 else []
            deltas = [model.read(t["POSITION"]) for t in primitive.get("targets", [])] if noted else []
            influences = None
            if "skin" in node and noted:
                skin = document["skins"][node["skin"]]
                binds = [columns(m) for m in model.read(skin["inverseBindMatrices"])]
                joints = [times_matrix(matrices[j], b) for j, b in zip(skin["joints"], binds)]
                attributes = primitive["attributes"]
                influences = list(zip(model.read(attributes["JOINTS_0"]), model.read(attributes["WEIGHTS_0"])))
            for vertex in noted:
                p = [x + sum(w * d[vertex][c] for w, d in zip(weights, deltas)) for c, x in enumerate(positions[vertex])]
                if influences is None:
                    p = apply(matrices[number], p)
                else:
                    pulls = [(w, apply(joints[j], p)) for j, w in zip(*influences[vertex]) if w > 0]
                    total = sum(w for w, _ in pulls)
                    p = [sum(w * q[c] for w, q in pulls) / total for c in range(3)]
                yield instance, first + vertex, p
            first += len(positions)


def main():
    folder = Path(sys.argv[1]) / "gltf"
    print("file\tanimation\ttime\tinstance\tvertex\tx\ty\tz")
    for name, animation, times in CASES:
        model = Model(folder / name)
        for time in times:
            for instance, vertex, p in rows(model, animation, time, noted_vertices(name)):
                place = "\t".join(f"{x:.7g}" for x in p)
                print(f"{name}\t{animation}\t{time}\t{instance}\t{vertex}\t{place}")


main()
