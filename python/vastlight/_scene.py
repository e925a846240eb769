"""Open scenes: what is in them, changes of it, arrays of rays."""

from __future__ import annotations

import difflib
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import as_array, as_faces, as_matrix, as_number, as_rows, parse_bytes
from ._changes import Environment, Light, Looks, Material, Table, to_json
from ._errors import SceneError, UsageError

if TYPE_CHECKING:
    from ._render import CameraView

Changes = Mapping[str, Any]
Overrides = str | os.PathLike[str] | Changes | Sequence[str | os.PathLike[str] | Changes]


class Hits(NamedTuple):
    """The closest hits of ``N`` rays, a row each; misses have their rows too.

    Attributes:
        t: (N,) float32, in units of the direction's length; infinite for a miss.
        prim: (N,) int32, the triangle of the instance's mesh; -1 for a miss, and on a surface without triangles.
        instance: (N,) int32, the instance's number (see :attr:`Scene.names`); -1 for a miss.
        uv: (N, 2) float32, weights of the triangle's second and third corner; 0 for a miss.
        normal: (N, 3) float32, unit normal of the triangle in world space; 0 for a miss, and on a surface without triangles.
    """

    t: npt.NDArray[np.float32]
    prim: npt.NDArray[np.int32]
    instance: npt.NDArray[np.int32]
    uv: npt.NDArray[np.float32]
    normal: npt.NDArray[np.float32]


class Missing(SceneError, KeyError):
    """A name that is not in the scene."""

    __str__ = SceneError.__str__


def missing(kind: str, name: str, known: Sequence[str]) -> Missing:
    """The error for a name that is not there, with those that are like it."""
    near = difflib.get_close_matches(name, known, n=3) or list(dict.fromkeys(known))[:8]
    hint = "there are " + ", ".join(near) if near else "there are none"
    return Missing(f'no {kind} is named "{name}"', "scene", hint)


class Object:
    """An object of a scene: an instance of a mesh, or several of one name."""

    def __init__(self, scene: Scene, name: str) -> None:
        self._scene = scene
        self._name = name

    @property
    def name(self) -> str:
        """Its name."""
        return self._name

    @property
    def instances(self) -> tuple[int, ...]:
        """Numbers of the instances of this name, as in :attr:`Hits.instance`; adding or removing things changes them."""
        return self._scene._numbers(self._name)

    def _single(self) -> int:
        numbers = self.instances
        if len(numbers) > 1:
            hint = "use scene.instance_transform(number)"
            raise SceneError(f"{len(numbers)} instances have this name", f'"{self._name}"', hint)
        return numbers[0]

    @property
    def _mesh(self) -> int:
        meshes = {self._scene._core.mesh_of(number) for number in self.instances}
        if len(meshes) > 1:
            raise SceneError(f"{len(meshes)} meshes have this name", f'"{self._name}"')
        return meshes.pop()

    @property
    def transform(self) -> npt.NDArray[np.float64]:
        """World from object, (4, 4) float64 for column vectors: the translation is the last column. A copy; assign to change it.

        What moves goes back to its motion with :meth:`Scene.set_time`, and when a picture opens the shutter or closes it.
        """
        return self._scene._core.transform(self._single())

    @transform.setter
    def transform(self, matrix: npt.ArrayLike) -> None:
        self._scene._core.set_transform(self._single(), as_matrix(matrix))

    @property
    def vertices(self) -> npt.NDArray[np.float32]:
        """Vertices of its mesh in object space, (N, 3) float32. A copy; assign as many to change the mesh, for all its instances.

        Structures for rays are refitted, updated or rebuilt, whichever suits; shading normals are derived if the mesh has some
        (:meth:`set_vertices` takes others). Positions snap to a lattice of 24 bits over the mesh.
        """
        return self._scene._core.vertices(self._mesh)

    @vertices.setter
    def vertices(self, vertices: npt.ArrayLike) -> None:
        self.set_vertices(vertices)

    def set_vertices(self, vertices: npt.ArrayLike, normals: npt.ArrayLike | None = None) -> None:
        """Gives its mesh other vertices, (N, 3), and shading normals, (N, 3), if it has some."""
        given = None if normals is None else as_rows(normals, 3, "normals")
        self._scene._core.set_vertices(self._mesh, as_rows(vertices, 3, "vertices"), given)

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """Triangles of its mesh, (M, 3) uint32 into :attr:`vertices`; of a scene in a store empty."""
        return self._scene._core.faces(self._mesh)

    def __repr__(self) -> str:
        return f"vastlight.Object {self._name!r}, instances {self.instances}"


class Scene(Mapping[str, Object]):
    """A scene, with what pictures and rays of it share.

    ``scene["Chair"]`` is an object by name; iteration gives the names. ``Scene()`` is empty, for :meth:`add_mesh`.
    Right-handed, y up, metres; colours are linear Rec. 709.

    Args:
        memory: budget such as ``"8GiB"``, or bytes; three quarters of the machine without.
        threads: for all work on the scene; one for each processor without.
    """

    _core: _native.Scene
    _looks: Looks
    _index: dict[str, tuple[int, ...]] | None
    _known: set[str]
    # Materials of one mesh alone, and those of them whose mesh is gone.
    _own: set[str]
    _free: set[str]

    def __init__(self, *, memory: int | str | None = None, threads: int | None = None) -> None:
        self._begin(_native.Scene.empty({"memory": parse_bytes(memory, "memory"), "threads": threads}))

    @classmethod
    def _of(cls, native: _native.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._begin(native)
        return scene

    def _begin(self, native: _native.Scene) -> None:
        self._core = native
        self._looks = Looks(native)
        self._index = None
        self._known = set(native.names())
        self._own, self._free = set(), set()

    # Objects

    def _table(self) -> dict[str, tuple[int, ...]]:
        if self._index is None:
            found: dict[str, list[int]] = {}
            for number, name in enumerate(self._core.names()):
                found.setdefault(name, []).append(number)
            self._index = {name: tuple(numbers) for name, numbers in found.items()}
        return self._index

    def _numbers(self, name: str) -> tuple[int, ...]:
        table = self._table()
        if name not in table:
            raise missing("object", name, list(table))
        return table[name]

    def __getitem__(self, name: str) -> Object:
        self._numbers(name)
        return Object(self, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._table())

    def __len__(self) -> int:
        return len(self._table())

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    @property
    def names(self) -> list[str]:
        """The name of each instance, by its number."""
        return self._core.names()

    def instance_transform(self, number: int) -> npt.NDArray[np.float64]:
        """World from object of an instance by its number, (4, 4) float64."""
        return self._core.transform(as_number(number))

    def set_instance_transform(self, number: int, transform: npt.ArrayLike) -> None:
        """Puts an instance, by its number, in another place."""
        self._core.set_transform(as_number(number), as_matrix(transform))

    def add_mesh(
        self,
        name: str,
        mesh: Any = None,
        *,
        vertices: npt.ArrayLike | None = None,
        faces: npt.ArrayLike | None = None,
        normals: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        material: str | Changes | None = None,
        transform: npt.ArrayLike | None = None,
    ) -> Object:
        """Puts a mesh into the scene. Many in a row cost no more than one: they are taken up together.

        Args:
            name: of the object; it must be a new one.
            mesh: a ``trimesh.Trimesh``, or anything with ``vertices`` and ``faces``, in place of the arrays.
            vertices: (N, 3), object space.
            faces: (M, 3) integers, counter-clockwise seen from the front.
            normals: (N, 3) shading normals; flat without.
            uvs: (N, 2) texture coordinates.
            material: the name of one that is there, or the keys of a new one of the object's name (see :attr:`materials`), or nothing
                for a neutral one.
            transform: world from object, (4, 4).
        """
        if mesh is not None:
            if vertices is not None or faces is not None:
                raise UsageError("there are two meshes", "mesh", "give a mesh or arrays")
            vertices, faces = mesh.vertices, mesh.faces
        if vertices is None or faces is None:
            raise UsageError("a mesh has vertices and faces", "add_mesh")
        if name in self._known:
            raise UsageError(f'"{name}" is in the scene already', "name", "take another name, or remove it first")
        looks = material if isinstance(material, Mapping) else None
        used = name if looks is not None else cast("str | None", material)
        if looks is not None and name not in self._free:
            self._refuse("materials", name)
        self._core.add_mesh(
            {
                "name": name,
                "vertices": as_rows(vertices, 3, "vertices"),
                "faces": as_faces(faces),
                "normals": None if normals is None else as_rows(normals, 3, "normals"),
                "uvs": None if uvs is None else as_rows(uvs, 2, "uvs"),
                "transform": as_matrix(np.eye(4) if transform is None else transform),
                "material": used,
                "looks": None if looks is None else _looks_of(name, looks),
            }
        )
        self._known.add(name)
        self._index = None
        if used is not None:
            self._free.discard(used)
            self._own.discard(used)
        if looks is not None:
            self._own.add(name)
            self._dressed(name, looks)
        return Object(self, name)

    def _refuse(self, kind: str, name: str) -> None:
        """Refuses a name that is in a table."""
        if name == "*" or self._core.has(kind, name):
            raise UsageError(f'"{name}" is in the scene already', "name", "take another name")

    def _dressed(self, name: str, looks: Changes) -> None:
        """Takes note of a new material: its own looks come after those of all."""
        self._looks.forget(["materials", name])
        if looks and self._looks.of(["materials", "*"]):
            self._looks.change(["materials", name], looks)

    def add_material(self, name: str, **values: Any) -> Material:
        """Puts a material into the scene; `values` are its keys (see :attr:`materials`)."""
        self._refuse("materials", name)
        self._core.add_material(name, _looks_of(name, values))
        self._dressed(name, values)
        return Material(self._looks, name)

    def add_light(
        self,
        name: str,
        kind: str = "point",
        *,
        intensity: npt.ArrayLike = (1.0, 1.0, 1.0),
        transform: npt.ArrayLike | None = None,
        inner_angle: float = 0.0,
        outer_angle: float = math.pi / 4,
    ) -> Light:
        """Puts a light without surface into the scene. Meshes whose material has an ``emission`` are lights too.

        Args:
            name: of the light.
            kind: ``"point"``, ``"spot"`` or ``"directional"``; the last two shine along -z.
            intensity: W/sr, of a directional light W/m^2; per channel.
            transform: world from light, (4, 4).
            inner_angle: half angle of a spot's full intensity, radians.
            outer_angle: half angle at which a spot ends, radians.
        """
        self._refuse("lights", name)
        red, green, blue = (float(x) for x in np.broadcast_to(as_array(intensity, np.float64), 3))
        matrix = as_matrix(np.eye(4) if transform is None else transform)
        self._core.add_light(name, kind, (red, green, blue), matrix, (inner_angle, outer_angle))
        return Light(self._looks, name)

    def add_camera(
        self,
        name: str,
        transform: npt.ArrayLike,
        *,
        fov: float = 40.0,
        lens_radius: float = 0.0,
        focus_distance: float = 1.0,
    ) -> None:
        """Puts a camera into the scene, which looks along its -z.

        Args:
            name: for ``camera=`` of :func:`render`.
            transform: world from camera, (4, 4).
            fov: full vertical angle of view, degrees.
            lens_radius: metres; 0 is a pinhole.
            focus_distance: metres along the view.
        """
        lens = (math.radians(fov), lens_radius, focus_distance)
        self._core.add_camera(name, as_matrix(transform), lens)

    def remove(self, name: str) -> None:
        """Takes the instances of a name out of the scene, and meshes of which none is left."""
        self._core.remove(list(self._numbers(name)))
        self._known.discard(name)
        self._index = None
        self._free |= self._own & {name}

    # Looks

    @property
    def materials(self) -> Table[Material]:
        """Materials by name: ``scene.materials["Wood"].roughness = 0.3``. Keys are those of ``docs/overrides.md``."""
        return Table(self._looks, "materials", Material, missing)

    @property
    def lights(self) -> Table[Light]:
        """Lights without surface by name: ``intensity``, ``scale``, ``ies``."""
        return Table(self._looks, "lights", Light, missing)

    @property
    def environment(self) -> Environment:
        """Light from infinity: ``map``, ``color`` or ``sun``; ``strength``, ``rotation``, ``turbidity``."""
        return Environment(self._looks)

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras; pictures are taken with the first unless another is named."""
        return self._core.table("cameras")

    def camera(self, name: str | None = None) -> CameraView:
        """A camera of the scene, to be given to :func:`render` or changed first: ``scene.camera("far").with_fov(30)``."""
        from ._render import CameraView

        if name is not None and name not in self.cameras and not name.isdecimal():
            raise missing("camera", name, self.cameras)
        return CameraView(name=name)

    def look_at(self, eye: npt.ArrayLike, target: npt.ArrayLike, fov: float | None = None) -> CameraView:
        """A camera at `eye` that looks at `target`, world space, with a full vertical angle of view in degrees."""
        from ._render import CameraView

        return CameraView(look_at=(_point(eye, "eye"), _point(target, "target")), fov=fov)

    # Time

    def set_time(self, seconds: float) -> None:
        """Brings what moves to a moment. Structures are refitted, updated or rebuilt, whichever suits."""
        self._core.set_time(seconds)

    @property
    def time(self) -> float | None:
        """The moment that was set, seconds; none for the scene at rest."""
        return self._core.movement()[2]

    @property
    def moves(self) -> bool:
        """Whether :meth:`set_time` does anything."""
        return self._core.movement()[0]

    @property
    def duration(self) -> float | None:
        """Seconds from the first moment, which is 0, to the last; none if nothing moves or there is no last."""
        return self._core.movement()[1]

    # Figures

    @property
    def bounds(self) -> npt.NDArray[np.float32] | None:
        """(2, 3) float32: the smallest and the largest corner of the box around all instances; none of an empty scene."""
        corners = self._core.bounds()
        return None if corners is None else cast("npt.NDArray[np.float32]", np.stack(corners))

    def stats(self) -> dict[str, int]:
        """Numbers of meshes, instances, triangles, materials, textures, lights and cameras."""
        counts: dict[str, int] = json.loads(self._core.counts())
        return counts

    @property
    def warnings(self) -> list[str]:
        """What was found wrong or left out when the scene was opened."""
        return [str(SceneError(*found)) for found in self._core.warnings()]

    @property
    def fingerprint(self) -> str:
        """32 hexadecimal digits that tell the scene's contents, as they are now, from others: names and dates of files do not count."""
        return self._core.fingerprint()

    @property
    def source(self) -> str:
        """Where it was opened; empty if nowhere."""
        return self._core.source

    def __repr__(self) -> str:
        stats = self.stats()
        source = f" {self.source!r}" if self.source else ""
        return f"vastlight.Scene{source}, {stats['instances']} instances, {stats['unique_triangles']} triangles"

    # Rays

    def trace(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: npt.ArrayLike = 0.0,
        tmax: npt.ArrayLike = math.inf,
    ) -> Hits:
        """The closest hit of each ray. Every surface counts, whatever its material's alpha.

        Contiguous float32 arrays are read where they are; others are converted. The interpreter goes on meanwhile.

        Args:
            origins: (N, 3), world space; or one point for all rays.
            directions: (N, 3) of any length; or one for all rays.
            tmin: smallest t that counts, one or (N,), in units of the direction's length.
            tmax: largest t that counts, one or (N,).
        """
        return Hits(*self._core.trace(_rays(origins, directions, tmin, tmax)))

    def occluded(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: npt.ArrayLike = 0.0,
        tmax: npt.ArrayLike = math.inf,
    ) -> npt.NDArray[np.bool_]:
        """Whether each ray hits anything between tmin and tmax: (N,) bool. Arguments are those of :meth:`trace`."""
        return self._core.occluded(_rays(origins, directions, tmin, tmax))


def _looks_of(name: str, looks: Changes) -> str:
    return to_json({"materials": {name: dict(looks)}})


def _rays(
    origins: npt.ArrayLike, directions: npt.ArrayLike, tmin: npt.ArrayLike, tmax: npt.ArrayLike
) -> tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any]]:
    starts, ways = as_rows(origins, 3, "origins"), as_rows(directions, 3, "directions")
    if len(starts) == 1 != len(ways):
        starts = np.ascontiguousarray(np.broadcast_to(starts, ways.shape))
    elif len(ways) == 1 != len(starts):
        ways = np.ascontiguousarray(np.broadcast_to(ways, starts.shape))
    return starts, ways, _bound(tmin, "tmin"), _bound(tmax, "tmax")


def _bound(values: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
    array = as_array(values, np.float32)
    if array.ndim > 1:
        raise UsageError(f"the shape is {array.shape}, not (N,)", name, "give one, or one for each ray")
    return array.reshape(-1)


def _point(values: npt.ArrayLike, name: str) -> tuple[float, float, float]:
    array = as_array(values, np.float64)
    if array.shape != (3,):
        raise UsageError(f"the shape is {array.shape}, not (3,)", name)
    return float(array[0]), float(array[1]), float(array[2])


def load(
    source: str | os.PathLike[str],
    *,
    memory: int | str | None = None,
    threads: int | None = None,
    time: float | None = None,
    env: str | os.PathLike[str] | None = None,
    sun: tuple[float, float] | None = None,
    overrides: Overrides | None = None,
    file_scene: str | None = None,
    animation: str | None = None,
    sequence_fps: float = 24.0,
    triangles: int | None = None,
    texture_bytes: int | str | None = None,
    cache_dir: str | os.PathLike[str] | None = None,
) -> Scene:
    """Opens a scene: glTF, GLB, OBJ, PLY or STL, a manifest (.toml), a store (.vls, also ``https://`` and ``s3://``), or ``"demo:NAME"``.

    Args:
        source: the file, or ``"demo:NAME"``.
        memory: budget such as ``"8GiB"``, or bytes: the largest resident set of the process. Work that needs more is refused before it
            starts. Three quarters of the machine without.
        threads: for all work on the scene; one for each processor without. Pictures do not depend on it.
        time: moment of a scene that moves, seconds.
        env: a latitude-longitude map (.exr, .hdr) for the environment.
        sun: azimuth (from -z towards +x) and elevation of the sun in a clear sky, degrees.
        overrides: changes of materials, lights and environment: a TOML file, a dictionary of the same shape (``docs/overrides.md``), or
            several of these, applied one after the other.
        file_scene: which of a glTF file's scenes, by name or number.
        animation: which of a glTF file's animations, by name or number.
        sequence_fps: files a second of a sequence (``mesh.####.ply``).
        triangles: of a demo scene whose size can be chosen.
        texture_bytes: of a demo scene that can be asked for them.
        cache_dir: folder where a scene that does not fit is packed, once, and opened from.

    Raises:
        SceneError: the source cannot be read or is wrong.
        MemoryBudgetError: it does not fit.
    """
    if overrides is None:
        given: list[Any] = []
    elif isinstance(overrides, (str, os.PathLike, Mapping)):
        given = [overrides]
    else:
        given = list(overrides)
    name = os.fspath(source)
    native = _native.Scene.load(
        {
            "source": name if "://" in name or name.startswith("demo:") else str(Path(name).expanduser()),
            "memory": parse_bytes(memory, "memory"),
            "threads": threads,
            "time": time,
            "env": None if env is None else os.fspath(env),
            "sun": None if sun is None else (float(sun[0]), float(sun[1])),
            "overrides": [(None, to_json(one)) if isinstance(one, Mapping) else (os.fspath(one), None) for one in given],
            "file_scene": file_scene,
            "animation": animation,
            "sequence_fps": sequence_fps,
            "triangles": triangles,
            "texture_bytes": parse_bytes(texture_bytes, "texture_bytes"),
            "cache_dir": None if cache_dir is None else os.fspath(cache_dir),
        }
    )
    return Scene._of(native)
