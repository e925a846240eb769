#!/usr/bin/env python3
"""Makes meshes on which nothing was tuned, with three ray files each, for against_embree.py.

usage: untuned_meshes.py BASE [NAME ...] [--vastlight PATH] [--models FOLDER]

BASE holds embree_bench/embree_bench, which is asked for the primary hits; meshes/NAME.ply and rays/NAME.KIND.rays are
written there. Names:

statue3M   `vastlight generate statue`, 3 M triangles
forest3M   160 trees, leaves as pairs of triangles in all directions, over rough ground: 3 M triangles
cad900K    the parts of a CAD model of a house, placed one by one: MODELS/cad/cafe-corner.glb
truck120K  a lorry from a modelling program: MODELS/furniture/peterbilt/peterbilt.obj

Primary rays: 1024 x 768 in scanline order. Diffuse: one bounce from each hit, cosine distributed. Shadow: from each hit
to a random place on a square light. Seeds are fixed: the same files every time.
"""
import argparse
import json
import pathlib
import struct
import subprocess

import numpy as np

WIDTH, HEIGHT = 1024, 768
# Eye, target, vertical angle in degrees; corner and edges of the light, all in units of the mesh's box, whose centre is
# zero and whose longest side goes from -1 to 1.
VIEWS = {
    "statue3M": ((1.6, 0.9, 2.1), (0.0, 0.0, 0.0), 38.0, ((-0.6, 2.0, 0.4), (0.8, 0.0, 0.0), (0.0, 0.0, 0.8))),
    "forest3M": ((0.9, 0.22, 0.95), (0.0, 0.0, 0.0), 50.0, ((-0.5, 1.5, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
    "cad900K": ((1.5, 0.8, 2.2), (0.0, 0.0, 0.0), 40.0, ((0.2, 1.9, 0.8), (0.8, 0.0, 0.0), (0.0, 0.0, 0.8))),
    "truck120K": ((0.7, 0.35, 0.9), (0.0, -0.02, 0.15), 45.0, ((-0.4, 1.2, -0.4), (0.8, 0.0, 0.0), (0.0, 0.0, 0.8))),
}


def write_ply(path, positions, triangles):
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\nproperty float x\n"
            f"property float y\nproperty float z\nelement face {len(triangles)}\n"
            "property list uchar int vertex_indices\nend_header\n")
    faces = np.empty(len(triangles), np.dtype([("count", "u1"), ("corners", "<i4", (3,))]))
    faces["count"], faces["corners"] = 3, triangles
    path.write_bytes(head.encode() + np.asarray(positions, "<f4").tobytes() + faces.tobytes())


def read_ply(path):
    """Positions and triangles of a binary PLY whose vertices have floats and bytes and whose faces are triangles."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    lines = [line.split() for line in data[:end].decode().splitlines()]
    counts = {line[1]: int(line[2]) for line in lines if line[0] == "element"}
    kinds = {"float": "<f4", "uchar": "u1"}
    vertex = np.dtype([(line[2], kinds[line[1]]) for line in lines if line[0] == "property" and line[1] in kinds])
    vertices = np.frombuffer(data, vertex, counts["vertex"], end)
    faces = np.dtype([("count", "u1"), ("corners", "<i4", (3,))])
    corners = np.frombuffer(data, faces, counts["face"], end + vertices.nbytes)
    assert (corners["count"] == 3).all(), "faces that are no triangles"
    return np.stack([vertices[axis] for axis in "xyz"], 1), corners["corners"]


def join(parts):
    """One mesh of many."""
    firsts = np.cumsum([0] + [len(positions) for positions, _ in parts[:-1]])
    triangles = [triangles + first for (_, triangles), first in zip(parts, firsts)]
    return np.concatenate([positions for positions, _ in parts]), np.concatenate(triangles)


def statue(args, base):
    path = base / "statue.ply"
    subprocess.run([args.vastlight, "generate", "statue", "-o", str(path), "--triangles", "3000000", "-q"], check=True)
    mesh = read_ply(path)
    path.unlink()
    return mesh


def ground(random, cells, size):
    line = np.linspace(-size, size, cells + 1)
    x, z = np.meshgrid(line, line, indexing="ij")
    y = 0.15 * np.sin(x * 1.3) * np.cos(z * 0.9) + random.normal(0.0, 0.02, x.shape)
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (q.ravel() for q in (at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]))
    triangles = np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])
    return np.stack([x, y, z], -1).reshape(-1, 3), triangles


def limb(start, end, thick, thin, sides=8):
    """An open cone between two points."""
    axis = (end - start) / np.linalg.norm(end - start)
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.7 else [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    angle = np.arange(sides) * (2.0 * np.pi / sides)
    ring = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * np.cross(axis, across)
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    triangles = np.concatenate([np.stack([i, j, i + sides], 1), np.stack([j, j + sides, i + sides], 1)])
    return np.concatenate([start + thick * ring, end + thin * ring]), triangles


def leaves(random, tips, count):
    """Two triangles a leaf, folded along the middle, around the tips of branches."""
    center = tips[random.integers(0, len(tips), count)] + random.normal(0.0, 0.22, (count, 3))
    along, across = random.normal(size=(2, count, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, across)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    size = random.uniform(0.025, 0.06, (count, 1))
    fold = np.cross(along, across) * size * 0.2
    corners = [center - along * size, center + across * size * 0.5 + fold, center + along * size,
               center - across * size * 0.5 + fold]
    first = 4 * np.arange(count)[:, None]
    triangles = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    return np.stack(corners, 1).reshape(-1, 3), triangles


def forest(_args, _base):
    random = np.random.default_rng(20)
    parts = [ground(random, 120, 11.0)]
    for number in range(160):
        foot = np.array([random.uniform(-10.0, 10.0), -0.2, random.uniform(-10.0, 10.0)])
        top = foot + [0.0, random.uniform(1.8, 3.4), 0.0]
        parts.append(limb(foot, top, 0.11, 0.03))
        tips = []
        for _ in range(28):
            start = foot + (top - foot) * random.uniform(0.4, 1.0)
            tips.append(start + random.normal(0.0, [0.45, 0.25, 0.45]) + [0.0, 0.2, 0.0])
            parts.append(limb(start, tips[-1], 0.025, 0.006, 5))
        parts.append(leaves(random, np.array(tips), 9150))
    return join(parts)


def cad(args, _base):
    """The placed meshes of a GLB without hierarchy."""
    data = (args.models / "cad/cafe-corner.glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    scene, binary = json.loads(data[20:20 + length]), data[28 + length:]

    def numbers(accessor, width):
        accessor = scene["accessors"][accessor]
        view = scene["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        kind = {5125: "<u4", 5126: "<f4"}[accessor["componentType"]]
        return np.frombuffer(binary, kind, accessor["count"] * width, start).reshape(-1, width)

    parts = []
    for node in scene["nodes"]:
        assert "children" not in node and "mesh" in node, "a hierarchy"
        matrix = np.array(node["matrix"]).reshape(4, 4)
        for part in scene["meshes"][node["mesh"]]["primitives"]:
            positions = numbers(part["attributes"]["POSITION"], 3) @ matrix[:3, :3] + matrix[3, :3]
            parts.append((positions, numbers(part["indices"], 1).reshape(-1, 3).astype("i4")))
    return join(parts)


def truck(args, _base):
    positions, triangles = [], []
    for line in (args.models / "furniture/peterbilt/peterbilt.obj").read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            fan = [int(word.split("/")[0]) - 1 for word in words[1:]]
            triangles += [[fan[0], b, c] for b, c in zip(fan[1:], fan[2:])]
    return np.array(positions), np.array(triangles)


def in_unit_cube(positions):
    """Moved and scaled so that the box's centre is zero and its longest side goes from -1 to 1."""
    low, high = positions.min(0), positions.max(0)
    return ((positions - (low + high) / 2) * (2.0 / (high - low).max())).astype("<f4")


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def rays(origins, directions, lengths):
    out = np.zeros((len(directions), 8), "<f4")
    out[:, 0:3], out[:, 4:7], out[:, 7] = origins, directions, lengths
    return out


def primary(eye, target, degrees):
    forward = unit(np.array(target) - np.array(eye))
    right = unit(np.cross(forward, [0.0, 1.0, 0.0]))
    up, half = np.cross(right, forward), np.tan(np.radians(degrees) / 2)
    x = ((np.arange(WIDTH) + 0.5) * 2 - WIDTH) / HEIGHT * half
    y = (HEIGHT - (np.arange(HEIGHT) + 0.5) * 2) / HEIGHT * half
    directions = forward + y[:, None, None] * up + x[None, :, None] * right
    return rays(np.array(eye), unit(directions).reshape(-1, 3), 1e30)


def secondary(first, distance, triangle, mesh, light):
    """Diffuse and shadow rays from the hits of the first."""
    random = np.random.default_rng(5)
    hit = triangle != 0xFFFFFFFF
    first, distance = first[hit].astype("f8"), distance[hit].astype("f8")
    a, b, c = np.moveaxis(mesh[0][mesh[1][triangle[hit]]].astype("f8"), 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    normal = np.where((normal * first[:, 4:7]).sum(1, keepdims=True) > 0.0, -normal, normal)
    origin = first[:, :3] + distance[:, None] * first[:, 4:7] + normal * 1e-4
    bounce = unit(normal + 0.9999 * unit(random.normal(size=origin.shape)))
    corner, along, across = (np.array(v) for v in light)
    place = corner + random.random((len(origin), 1)) * along + random.random((len(origin), 1)) * across
    way = place - origin
    length = np.linalg.norm(way, axis=1)
    return rays(origin, bounce, 1e30), rays(origin, way / length[:, None], length * 0.999)


def main():
    makers = {"statue3M": statue, "forest3M": forest, "cad900K": cad, "truck120K": truck}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", type=pathlib.Path)
    parser.add_argument("names", nargs="*", choices=[[], *makers], metavar="NAME")
    parser.add_argument("--vastlight", default="target/release/vastlight")
    parser.add_argument("--models", type=pathlib.Path, default=pathlib.Path("../shared/models"))
    args = parser.parse_args()
    for folder in ("meshes", "rays"):
        (args.base / folder).mkdir(parents=True, exist_ok=True)
    for name in args.names or makers:
        positions, triangles = makers[name](args, args.base)
        mesh = (in_unit_cube(positions), triangles)
        path, dump = args.base / "meshes" / f"{name}.ply", args.base / "rays" / f"{name}.hits"
        files = {kind: args.base / "rays" / f"{name}.{kind}.rays" for kind in ("primary", "diffuse", "shadow")}
        write_ply(path, *mesh)
        eye, target, degrees, light = VIEWS[name]
        first = primary(eye, target, degrees)
        first.tofile(files["primary"])
        subprocess.run([str(args.base / "embree_bench/embree_bench"), str(path), str(files["primary"]), "--reps", "1",
                        "--builds", "1", "--dump", str(dump)], check=True, stdout=subprocess.DEVNULL)
        hits = np.fromfile(dump, np.dtype([("t", "<f4"), ("triangle", "<u4")]))
        dump.unlink()
        diffuse, shadow = secondary(first, hits["t"], hits["triangle"], mesh, light)
        diffuse.tofile(files["diffuse"])
        shadow.tofile(files["shadow"])
        print(f"{name}: {len(triangles)} triangles, {len(first)} primary rays, {len(diffuse)} of each other kind")


if __name__ == "__main__":
    main()
