"""An animation: the scene's own movement, and a mesh that a program moves."""

import os

import numpy as np

import vastlight as vl

width, height = map(int, os.environ.get("VASTLIGHT_EXAMPLE_SIZE", "480x270").split("x"))

scene = vl.load("demo:walker")
for frame in range(4):
    scene.set_time(frame / 12)
    vl.render(scene, size=(width, height), spp=16, shutter=0.5 / 12).save(f"walker.{frame:04}.png")

# A wave: new vertices each frame; the structures follow.
x, z = np.meshgrid(np.linspace(-2, 2, 80), np.linspace(-2, 2, 80))
at = np.arange(80 * 80).reshape(80, 80)
a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
faces = np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in [(a, b, c), (a, c, d)]])


def wave(time: float) -> np.ndarray:
    return np.stack([x, 0.2 * np.sin(3 * x + 4 * time) * np.cos(2 * z), z], axis=-1).reshape(-1, 3)


pool = vl.Scene()
pool.environment.sun = (120.0, 35.0)
water = pool.add_mesh("water", vertices=wave(0), faces=faces, material={"base_color": [0.1, 0.3, 0.4], "roughness": 0.1})
for frame in range(4):
    water.vertices = wave(frame / 12)
    vl.render(pool, size=(width, height), spp=16, look_at=((0, 2, 4), (0, 0, 0))).save(f"water.{frame:04}.png")
