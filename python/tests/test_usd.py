"""USD stages, where usd-core is there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import vastlight as vl

pytest.importorskip("pxr", reason="usd-core: not installed")

STAGE = """#usda 1.0
(
    upAxis = "Z"
    metersPerUnit = 0.01
)
def Xform "Room"
{
    double3 xformOp:translate = (0, 0, 100)
    uniform token[] xformOpOrder = ["xformOp:translate"]

    def Mesh "Table" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        point3f[] points = [(-100, -100, 0), (100, -100, 0), (100, 100, 0), (-100, 100, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        rel material:binding = </Room/Red>
    }

    def Material "Red"
    {
        token outputs:surface.connect = </Room/Red/Shader.outputs:surface>

        def Shader "Shader"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.8, 0.1, 0.1)
            float inputs:roughness = 0.4
            token outputs:surface
        }
    }

    def SphereLight "Bulb"
    {
        float inputs:radius = 10
        float inputs:intensity = 50
        double3 xformOp:translate = (0, 0, 150)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }

    def DistantLight "Sun"
    {
        float inputs:intensity = 3
        float inputs:exposure = 1
    }

    def Camera "View"
    {
        float focalLength = 35
        float verticalAperture = 24
        double3 xformOp:translate = (0, 0, 300)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }

    def Cube "Box"
    {
    }
}
"""


def test_a_stage_becomes_a_scene(tmp_path: Path) -> None:
    from vastlight import usd

    path = tmp_path / "room.usda"
    path.write_text(STAGE)
    with pytest.warns(UserWarning, match="Cube"):
        scene = usd.load(path)
    assert set(scene) == {"/Room/Table", "/Room/Bulb"}
    assert scene.cameras == ["/Room/View"] and list(scene.lights) == ["/Room/Sun"]
    # The table is a square of two metres at a height of one.
    hits = scene.trace([[0, 1.2, 0], [0.99, 1.2, 0.99], [1.01, 1.2, 0]], [0, -1, 0])
    assert hits.t == pytest.approx([0.2, 0.2, np.inf], rel=1e-5)
    assert hits.normal[0] == pytest.approx([0, 1, 0], abs=1e-6)
    assert scene.trace([[0, 1.1, 0]], [0, 1, 0]).t[0] == pytest.approx(1.3, abs=0.01)
    red = scene.materials["/Room/Red"]
    assert red.base_color == pytest.approx([0.8, 0.1, 0.1]) and red.roughness == pytest.approx(0.4)
    assert scene.lights["/Room/Sun"].intensity == pytest.approx([6, 6, 6])
    color = np.asarray(vl.render(scene, size=(32, 24), spp=4))
    corner = color[3:8, 7:12].mean(axis=(0, 1))
    assert corner[0] > 2 * corner[1] > 0


PARTS = """#usda 1.0
def Mesh "Table"
{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    rel material:binding = </Wild>

    def GeomSubset "Part" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </Wild>
    }
}

def Material "Wild"
{
    token outputs:surface.connect = </Wild/Shader.outputs:surface>

    def Shader "Shader"
    {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness = 1.5
        float inputs:ior = 0.5
        token outputs:surface
    }
}

def SphereLight "Spot" (
    prepend apiSchemas = ["ShapingAPI"]
)
{
    float inputs:radius = 0.1
    float inputs:shaping:cone:angle = 30
    bool inputs:enableColorTemperature = 1
}
"""


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    from vastlight import usd

    path = tmp_path / "parts.usda"
    path.write_text(PARTS)
    with pytest.warns(UserWarning) as told:
        scene = usd.load(path)
    said = str(told[0].message)
    for what in ("parts of meshes", "cones", "colour temperatures", "beyond their range"):
        assert what in said
    wild = scene.materials["/Wild"]
    assert wild.roughness == 1.0 and wild.ior == 1.0


def test_stages_that_cannot_be_opened(tmp_path: Path) -> None:
    from vastlight import usd

    with pytest.raises(vl.SceneError, match="none.usda"):
        usd.load(tmp_path / "none.usda")
