"""Compares the peer scene with Mitsuba (PyPI `mitsuba`): the same mesh, lights and camera.

    python compare_mitsuba.py PEER_SCENE_BINARY MESH.ply [REFERENCE_SPP]

PEER_SCENE_BINARY is the example `peer_scene`, built for release. Its means must agree within 0.5 %, and its error against
Mitsuba's long render must fall as 1 / spp. Prints one JSON line a check; exits 1 if one fails. The LLVM variant needs
DRJIT_LIBLLVM_PATH, else the scalar one is used.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np

WIDTH, HEIGHT, DEPTH = 320, 240, 4


def mitsuba_scene(mesh):
    """The scene of examples/peer_scene.rs."""
    transform = mi.ScalarTransform4f

    def diffuse(albedo):
        return {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}}

    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": DEPTH, "rr_depth": 100},
        "sensor": {
            "type": "perspective", "fov": 40.0, "fov_axis": "y",
            "to_world": transform().look_at(origin=(1.5, 1.15, 1.9), target=(0, 0.38, 0), up=(0, 1, 0)),
            "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent", "sample_count": 16},
        },
        "sky": {"type": "constant", "radiance": 0.5},
        "floor": {"type": "rectangle", "bsdf": diffuse(0.4),
                  "to_world": transform().translate([0, -0.45, 0]).rotate([1, 0, 0], -90).scale(10.0)},
        "lamp": {"type": "rectangle", "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 8.0}},
                 "bsdf": diffuse(0.0),
                 "to_world": transform().translate([0, 2.6, 0]).rotate([1, 0, 0], 90).scale(0.7)},
        "mesh": {"type": "ply", "filename": mesh, "face_normals": True,
                 "bsdf": {"type": "twosided", "b": diffuse(0.6)}},
    })


def render_mitsuba(scene, spp, passes):
    """Mean over passes of `spp` samples, so that none needs more memory than one."""
    total = sum(np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float64) for seed in range(passes))
    return total / passes


def render_ours(binary, mesh, spp, folder):
    """Our picture and its JSON line."""
    out = str(Path(folder) / f"ours{spp}.exr")
    line = subprocess.run([binary, mesh, out, str(spp), str(WIDTH), str(HEIGHT)], check=True,
                          capture_output=True, text=True).stdout
    return np.array(mi.Bitmap(out), dtype=np.float64)[..., :3], json.loads(line)


def relmse(a, b):
    """mean((a - b)^2 / (b^2 + 0.01))."""
    return float(np.mean((a - b) ** 2 / (b ** 2 + 0.01)))


def main():
    binary, mesh = sys.argv[1:3]
    passes = max(1, int(sys.argv[3]) // 64 if len(sys.argv) > 3 else 16)
    mi.set_variant("llvm_ad_rgb" if "DRJIT_LIBLLVM_PATH" in os.environ else "scalar_rgb")
    reference = render_mitsuba(mitsuba_scene(mesh), 64, passes)
    failed = False
    errors = []
    with tempfile.TemporaryDirectory() as folder:
        for spp in (4, 16, 64):
            ours, line = render_ours(binary, mesh, spp, folder)
            ratio = float(ours.mean() / reference.mean())
            errors.append(relmse(ours, reference))
            failed |= abs(ratio - 1.0) > 0.005
            print(json.dumps({"check": "mean", "spp": spp, "ratio": ratio, "relmse": errors[-1],
                              "msamples_per_s": line["msamples_per_s"], "ok": abs(ratio - 1.0) <= 0.005}), flush=True)
    # The reference has an error of its own, so the last step falls a little short of four.
    factors = [errors[0] / errors[1], errors[1] / errors[2]]
    fall = all(2.5 < factor < 8.0 for factor in factors)
    control = relmse(reference * 1.05, reference) > 0.5 * errors[2]
    print(json.dumps({"check": "fall of relmse", "factors": factors, "ok": fall}))
    print(json.dumps({"check": "control: 5 % brighter is seen", "ok": bool(control)}))
    sys.exit(1 if failed or not fall or not control else 0)


if __name__ == "__main__":
    main()
