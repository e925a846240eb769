"""USD stages as scenes, by `usd-core` (``pip install 'vastlight[usd]'``).

Meshes with their transforms, colours of ``UsdPreviewSurface`` (textures are left out), cameras, and distant, sphere, rect, disk and
dome lights; up axis and units of the stage. Subdivision surfaces are taken as their cages. What is left out is warned of.
"""

from __future__ import annotations

import math
import os
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade  # type: ignore[import-not-found,import-untyped,unused-ignore]

from ._errors import SceneError
from ._scene import Scene

_Array = npt.NDArray[Any]

_Z_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)

_INPUTS = {
    "diffuseColor": "base_color",
    "emissiveColor": "emission",
    "roughness": "roughness",
    "metallic": "metallic",
    "opacity": "alpha",
    "ior": "ior",
    "clearcoat": "clearcoat",
    "clearcoatRoughness": "clearcoat_roughness",
}


def load(
    path: str | os.PathLike[str],
    *,
    time: float | None = None,
    memory: int | str | None = None,
    threads: int | None = None,
) -> Scene:
    """Opens a USD stage (.usd, .usda, .usdc, .usdz) as a scene; objects have the names of their prims' paths.

    Args:
        path: the file.
        time: time code of the stage; its default without.
        memory: see :func:`vastlight.load`.
        threads: see :func:`vastlight.load`.
    """
    try:
        stage = Usd.Stage.Open(os.fspath(path))
    except Exception as error:
        raise SceneError(str(error).strip().splitlines()[-1], os.fspath(path)) from error
    return from_stage(stage, time=time, memory=memory, threads=threads)


def from_stage(
    stage: Any, *, time: float | None = None, memory: int | str | None = None, threads: int | None = None
) -> Scene:
    """The same of a ``pxr.Usd.Stage`` that is open."""
    return _Reader(stage, Scene(memory=memory, threads=threads), time).read()


class _Reader:
    """Puts a stage into a scene."""

    def __init__(self, stage: Any, scene: Scene, time: float | None) -> None:
        self._stage, self._scene = stage, scene
        self._time = Usd.TimeCode.Default() if time is None else Usd.TimeCode(time)
        self._unit = float(UsdGeom.GetStageMetersPerUnit(stage))
        self._world = np.diag([self._unit] * 3 + [1.0])
        if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
            self._world = _Z_UP @ self._world
        self._left_out: set[str] = set()
        self._materials: set[str] = set()

    def read(self) -> Scene:
        for prim in Usd.PrimRange.Stage(self._stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
            self._prim(prim)
        if self._left_out:
            warnings.warn(f"left out: {', '.join(sorted(self._left_out))}", stacklevel=3)
        return self._scene

    def _prim(self, prim: Any) -> None:
        imageable = UsdGeom.Imageable(prim)
        if not imageable or imageable.ComputeVisibility(self._time) == UsdGeom.Tokens.invisible:
            return
        if imageable.ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
            return
        if prim.IsA(UsdGeom.Mesh):
            self._mesh(prim)
        elif prim.IsA(UsdGeom.Camera):
            self._camera(prim)
        elif prim.HasAPI(UsdLux.LightAPI):
            self._light(prim)
        elif prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer):
            self._left_out.add(str(prim.GetTypeName()))

    def _place(self, prim: Any) -> _Array:
        """World from prim, for column vectors."""
        rows = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(self._time)
        return self._world @ np.array(Gf.Matrix4d(rows), dtype=np.float64).T

    def _rigid(self, prim: Any) -> _Array:
        """The same without scale, for what looks or shines along -z."""
        place = self._place(prim)
        axes, _ = np.linalg.qr(place[:3, :3])
        place[:3, :3] = axes * np.sign((axes * place[:3, :3]).sum(axis=0))
        return place

    # Meshes

    def _mesh(self, prim: Any) -> None:
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get(self._time) or [], dtype=np.float32).reshape(-1, 3)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get(self._time) or [], dtype=np.int64)
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(self._time) or [], dtype=np.int64)
        if not len(points) or counts.sum() != len(indices):
            self._left_out.add(f"{prim.GetPath()} (it has no faces)")
            return
        corners = _fans(counts)
        if mesh.GetOrientationAttr().Get(self._time) == UsdGeom.Tokens.leftHanded:
            corners = corners[:, ::-1]
        if any(self._is_bound(subset.GetPrim()) for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh)):
            self._left_out.add("materials of parts of meshes")
        normals, by_corner = self._normals(mesh, len(points), len(indices))
        if by_corner:
            points, indices = points[indices], np.arange(len(indices))
        self._scene.add_mesh(
            str(prim.GetPath()),
            vertices=points,
            faces=indices[corners],
            normals=normals,
            material=self._material(prim, mesh),
            transform=self._place(prim),
        )

    def _normals(self, mesh: Any, points: int, corners: int) -> tuple[_Array | None, bool]:
        """Normals, and whether there is one for each corner of a face."""
        primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
        given = primvar.ComputeFlattened(self._time) if primvar else mesh.GetNormalsAttr().Get(self._time)
        normals = np.array(given or [], dtype=np.float32).reshape(-1, 3)
        if len(normals) == corners != points:
            return normals, True
        return (normals, False) if len(normals) == points else (None, False)

    def _is_bound(self, prim: Any) -> bool:
        return bool(UsdShade.MaterialBindingAPI(prim).GetDirectBindingRel().GetTargets())

    def _material(self, prim: Any, mesh: Any) -> str | None:
        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if not bound:
            colors = mesh.GetDisplayColorAttr().Get(self._time)
            return None if not colors else self._named(f"{prim.GetPath()}.color", {"base_color": list(colors[0])})
        shader = bound.ComputeSurfaceSource()[0]
        values: dict[str, Any] = {}
        for name, key in _INPUTS.items():
            socket = shader.GetInput(name) if shader else None
            if not socket:
                continue
            if socket.HasConnectedSource():
                self._left_out.add("textures of materials")
                continue
            value = socket.Get(self._time)
            if value is not None:
                values[key] = self._in_range(key, value)
        return self._named(str(bound.GetPath()), values)

    def _in_range(self, key: str, value: Any) -> float | list[float]:
        """A number or a colour as a material takes it."""
        least, most = (1.0, math.inf) if key == "ior" else (0.0, 1.0 if isinstance(value, (int, float)) else math.inf)
        given = np.array(value, dtype=np.float64)
        taken = np.clip(given, least, most)
        if not np.array_equal(given, taken):
            self._left_out.add("numbers of materials beyond their range")
        result: float | list[float] = taken.tolist()
        return result

    def _named(self, name: str, values: dict[str, Any]) -> str:
        if name not in self._materials:
            self._scene.add_material(name, **values)
            self._materials.add(name)
        return name

    # Cameras and lights

    def _camera(self, prim: Any) -> None:
        camera = UsdGeom.Camera(prim).GetCamera(self._time)
        # Lengths of the lens are tenths of a unit of the stage.
        lens = camera.focalLength / 10 / (2 * camera.fStop) * self._unit if camera.fStop > 0 else 0.0
        self._scene.add_camera(
            str(prim.GetPath()),
            self._rigid(prim),
            fov=camera.GetFieldOfView(Gf.Camera.FOVVertical),
            lens_radius=lens,
            focus_distance=max(camera.focusDistance * self._unit, 1e-3),
        )

    def _light(self, prim: Any) -> None:
        name, light = str(prim.GetPath()), UsdLux.LightAPI(prim)
        strength = light.GetIntensityAttr().Get(self._time) * 2.0 ** light.GetExposureAttr().Get(self._time)
        color = np.array(light.GetColorAttr().Get(self._time), dtype=np.float64) * strength
        self._note_shape(prim, light)
        if prim.IsA(UsdLux.DistantLight):
            self._scene.add_light(name, "directional", intensity=color, transform=self._rigid(prim))
        elif prim.IsA(UsdLux.DomeLight):
            self._dome(UsdLux.DomeLight(prim), color)
        elif prim.IsA(UsdLux.SphereLight):
            radius = UsdLux.SphereLight(prim).GetRadiusAttr().Get(self._time)
            if UsdLux.SphereLight(prim).GetTreatAsPointAttr().Get(self._time) or radius == 0:
                self._scene.add_light(name, "point", intensity=color, transform=self._rigid(prim))
            else:
                self._lamp(prim, light, color, *_sphere(radius))
        elif prim.IsA(UsdLux.RectLight):
            rect = UsdLux.RectLight(prim)
            width, height = rect.GetWidthAttr().Get(self._time), rect.GetHeightAttr().Get(self._time)
            corners = np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]]) * [width / 2, height / 2, 1]
            self._lamp(prim, light, color, corners, np.array([[0, 1, 2], [0, 2, 3]]))
        elif prim.IsA(UsdLux.DiskLight):
            self._lamp(prim, light, color, *_disk(UsdLux.DiskLight(prim).GetRadiusAttr().Get(self._time)))
        else:
            self._left_out.add(str(prim.GetTypeName()))

    def _note_shape(self, prim: Any, light: Any) -> None:
        """Says what of a light is left out."""
        if light.GetEnableColorTemperatureAttr().Get(self._time):
            self._left_out.add("colour temperatures of lights")
        if prim.HasAPI(UsdLux.ShapingAPI):
            shaping = UsdLux.ShapingAPI(prim)
            angle, focus = shaping.GetShapingConeAngleAttr(), shaping.GetShapingFocusAttr()
            if (angle and angle.Get(self._time) < 90.0) or (focus and focus.Get(self._time) > 0.0):
                self._left_out.add("cones of lights")
            profile = shaping.GetShapingIesFileAttr()
            if profile and profile.Get(self._time):
                self._left_out.add("measured distributions of lights")

    def _lamp(self, prim: Any, light: Any, radiance: _Array, vertices: _Array, faces: _Array) -> None:
        """A light with a surface."""
        place = self._place(prim)
        if light.GetNormalizeAttr().Get(self._time):
            a, b, c = (((vertices @ place[:3, :3].T) / self._unit)[faces[:, i]] for i in range(3))
            radiance = radiance / (np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
        name = str(prim.GetPath())
        material = {"base_color": [0, 0, 0], "emission": radiance, "double_sided": False}
        self._scene.add_mesh(name, vertices=vertices, faces=faces, material=material, transform=place)

    def _dome(self, dome: Any, color: _Array) -> None:
        texture = dome.GetTextureFileAttr().Get(self._time)
        if texture is None or not texture.path:
            self._scene.environment.color = color
            return
        if not np.allclose(color, color[0]):
            self._left_out.add("the colour of a dome light with a texture")
        self._scene.environment.update(map=texture.resolvedPath or texture.path, strength=float(color.mean()))


def _fans(counts: _Array) -> _Array:
    """Triangles of polygons with so many corners, as numbers of corners."""
    firsts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    pieces = np.maximum(counts - 2, 0)
    first = np.repeat(firsts, pieces)
    step = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def _sphere(radius: float, rings: int = 16, sectors: int = 32) -> tuple[_Array, _Array]:
    polar, around = np.meshgrid(np.linspace(0, math.pi, rings + 1), np.arange(sectors) * math.tau / sectors, indexing="ij")
    vertices = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), -np.sin(polar) * np.sin(around)], axis=-1)
    at = np.arange((rings + 1) * sectors).reshape(rings + 1, sectors)
    a, b = at[:-1], at[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    return radius * vertices.reshape(-1, 3), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])


def _disk(radius: float, sectors: int = 48) -> tuple[_Array, _Array]:
    around = np.arange(sectors) * math.tau / sectors
    rim = np.stack([np.cos(around), -np.sin(around), np.zeros(sectors)], axis=1)
    numbers = np.arange(1, sectors + 1)
    faces = np.stack([np.zeros(sectors, dtype=np.int64), numbers, np.roll(numbers, -1)], axis=1)
    return radius * np.concatenate([np.zeros((1, 3)), rim]), faces
