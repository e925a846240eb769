#!/usr/bin/env python3
"""Makes the scene of the whole-renderer comparison as glTF: a mesh over a ground plane, a square light, a constant sky.

usage: mitsuba_scene.py MESH.ply OUT_FOLDER

Writes OUT_FOLDER/scene.gltf, scene.bin and environment.toml (a constant sky, for `--override`). The numbers are those
that the comparison gives every renderer: ground at y = -0.45 (20 x 20, albedo 0.4), object albedo 0.6, a light of
1.4 x 1.4 at y = 2.6 that faces down with radiance 8, a sky of radiance 0.5, a camera at (1.5, 1.15, 1.9) that looks at
(0, 0.38, 0) with a vertical angle of 40 degrees.
"""
import json
import pathlib
import sys

import numpy as np


def read_ply(path):
    """Positions and triangles of a binary little-endian PLY with float positions and triangles only."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts = {line.split()[1]: int(line.split()[2]) for line in data[:end].decode().splitlines()
              if line.startswith("element")}
    positions = np.frombuffer(data, "<f4", 3 * counts["vertex"], end).reshape(-1, 3)
    face = np.dtype([("n", "u1"), ("i", "<u4", (3,))])
    return positions, np.frombuffer(data, face, counts["face"], end + positions.nbytes)["i"]


def square(center, half, normal_y):
    """A horizontal square whose front faces up (normal_y = 1) or down (-1)."""
    corners = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], "f4") * half + np.array(center, "f4")
    order = [[0, 1, 2], [0, 2, 3]] if normal_y > 0 else [[0, 2, 1], [0, 3, 2]]
    return corners.astype("<f4"), np.array(order, "<u4")


def camera_matrix(eye, target):
    """Column-major matrix of a camera that looks along its -z."""
    eye, target = np.array(eye), np.array(target)
    back = eye - target
    back /= np.linalg.norm(back)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    return [float(x) for v, w in ((right, 0), (np.cross(back, right), 0), (back, 0), (eye, 1)) for x in (*v, w)]


def lambertian(name, albedo, radiance=0.0):
    extensions = {"KHR_materials_specular": {"specularFactor": 0.0}}
    material = {"name": name, "extensions": extensions,
                "pbrMetallicRoughness": {"baseColorFactor": [albedo] * 3 + [1], "metallicFactor": 0}}
    if radiance:
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": radiance}
        material["emissiveFactor"] = [1, 1, 1]
    return material


def main():
    mesh, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    parts = [("object", *read_ply(mesh), lambertian("object", 0.6)),
             ("ground", *square((0, -0.45, 0), 10, 1), lambertian("ground", 0.4)),
             ("light", *square((0, 2.6, 0), 0.7, -1), lambertian("light", 0.0, 8.0))]
    blob, views, accessors, meshes, nodes = b"", [], [], [], []
    for k, (name, positions, triangles, _) in enumerate(parts):
        for array, kind in ((positions, "VEC3"), (triangles.ravel(), "SCALAR")):
            array = np.ascontiguousarray(array)
            views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
            accessor = {"bufferView": len(views) - 1, "type": kind, "count": len(array),
                        "componentType": 5126 if kind == "VEC3" else 5125}
            if kind == "VEC3":
                accessor["min"], accessor["max"] = (getattr(array, f)(0).tolist() for f in ("min", "max"))
            accessors.append(accessor)
            blob += array.tobytes()
        meshes.append({"name": name, "primitives": [
            {"attributes": {"POSITION": 2 * k}, "indices": 2 * k + 1, "material": k}]})
        nodes.append({"name": name, "mesh": k})
    nodes.append({"name": "camera", "camera": 0, "matrix": camera_matrix((1.5, 1.15, 1.9), (0, 0.38, 0))})
    gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}],
            "extensionsUsed": ["KHR_materials_specular", "KHR_materials_emissive_strength"],
            "nodes": nodes, "meshes": meshes, "accessors": accessors, "bufferViews": views,
            "materials": [p[3] for p in parts], "buffers": [{"uri": "scene.bin", "byteLength": len(blob)}],
            "cameras": [{"type": "perspective", "perspective": {"yfov": float(np.radians(40)), "znear": 0.01}}]}
    (out / "scene.bin").write_bytes(blob)
    (out / "scene.gltf").write_text(json.dumps(gltf))
    (out / "environment.toml").write_text('[environment]\ncolor = [0.5, 0.5, 0.5]\n')


if __name__ == "__main__":
    main()
