"""With packages that are not there by default."""

from __future__ import annotations

import numpy as np
import pytest

import vastlight as vl


def test_trimesh_meshes_are_taken() -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh: not installed")
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=2.0)
    scene = vl.Scene()
    ball = scene.add_mesh("ball", sphere, material={"metal": "copper", "roughness": 0.2})
    assert np.allclose(ball.vertices, sphere.vertices, atol=1e-6) and np.array_equal(ball.faces, sphere.faces)
    hits = scene.trace([[0, 0, 5]], [[0, 0, -1]])
    assert hits.t[0] == pytest.approx(3.0, abs=0.05) and hits.normal[0, 2] > 0.9


def test_the_bar_shows_in_a_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    display = pytest.importorskip("IPython.display", reason="IPython: not installed")
    from vastlight import _progress

    shown: list[str] = []

    class Handle:
        def update(self, content: object) -> None:
            shown.append(content.data)  # type: ignore[attr-defined]

    monkeypatch.setattr(display, "display", lambda *_, **__: Handle())
    monkeypatch.setattr(_progress, "in_notebook", lambda: True)
    monkeypatch.setattr(_progress, "PREVIEW_SECONDS", 0.05)
    scene = vl.load("demo:cornell")
    vl.render(scene, size=(160, 100), spp=64, progress=True)
    assert shown[-1] == "" and any("<progress" in html for html in shown[:-1])
