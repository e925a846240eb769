"""Pictures of scenes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypedDict

if TYPE_CHECKING:
    from typing_extensions import Unpack

from . import _native
from ._accumulator import Accumulator, merge
from ._arrays import parse_bytes
from ._errors import UsageError
from ._image import Image
from ._progress import ProgressArgument, listener
from ._scene import Scene, _point

Integrator = Literal["path", "direct", "primary", "ao", "steps", "whitted", "photon-caustics"]
Point = Sequence[float]


@dataclass(frozen=True)
class CameraView:
    """Where a picture is taken from: see :meth:`Scene.camera` and :meth:`Scene.look_at`.

    Attributes:
        name: a camera of the scene; the first without.
        look_at: eye and target in world space, in place of the camera's.
        fov: full vertical angle of view in degrees, in place of the camera's.
    """

    name: str | None = None
    look_at: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    fov: float | None = None

    def with_fov(self, degrees: float) -> CameraView:
        """The same with another full vertical angle of view."""
        return replace(self, fov=degrees)


class RenderOptions(TypedDict, total=False):
    """What :func:`render`, :func:`accumulate` and :func:`progressive` share; every one may be left out.

    Attributes:
        size: width and height in pixels; 720 rows in the camera's shape, or 16:9, without.
        camera: a camera by name or number, or a view of :meth:`Scene.camera` or :meth:`Scene.look_at`; the scene's first without.
        look_at: eye and target, world space, in place of the camera's.
        fov: full vertical angle of view in degrees, in place of the camera's.
        crop: ``(x0, y0, x1, y1)`` in pixels, the last two excluded.
        integrator: ``"path"``, ``"direct"``, ``"primary"``, ``"ao"``, ``"steps"``, ``"whitted"`` or ``"photon-caustics"``.
        max_depth: longest path in segments: 1 sees emission alone, 2 adds direct light; 16 without.
        seed: another seed is another noise; 0 without.
        caustics: ``"off"``, or ``"photons"`` for light that mirrors and lenses focus.
        photons: that are sent for each pass.
        photon_radius: of the first photons, as a part of the scene's longest edge.
        russian_roulette: end long paths that carry little at random; true without.
        filter: pixel filter such as ``"gaussian:2"``.
        aovs: auxiliary outputs: ``albedo``, ``normal``, ``depth``, ``alpha``, ``position``, ``object``, ``material``.
        shutter: seconds for which the shutter is open from the scene's time on; 0 without. What moves is then where its motion
            takes it, whatever place or vertices it was given.
        shutter_keys: poses of what moves while the shutter is open; 5 without.
        device: ``"auto"``, ``"cpu"``, ``"gpu"`` or ``"gpu:N"``.
        gpu_memory: most memory on a graphics processor.
        threads: for this picture alone.
        memory: budget for this picture, such as ``"8GiB"``; the scene's without.
        accel: acceleration structure by name.
        progress: ``True`` for a bar or a notebook's display, or a function that is given a :class:`Progress` now and then.
    """

    size: tuple[int, int]
    camera: str | int | CameraView
    look_at: tuple[Point, Point]
    fov: float
    crop: tuple[int, int, int, int]
    integrator: Integrator
    max_depth: int
    seed: int
    caustics: Literal["off", "photons"]
    photons: int
    photon_radius: float
    russian_roulette: bool
    filter: str
    aovs: Sequence[str]
    shutter: float
    shutter_keys: int
    device: str
    gpu_memory: int | str
    threads: int
    memory: int | str
    accel: str
    progress: ProgressArgument


_DEFAULTS: dict[str, Any] = {
    "size": None,
    "fov": None,
    "crop": None,
    "integrator": "path",
    "max_depth": 16,
    "seed": 0,
    "caustics": "off",
    "photons": None,
    "photon_radius": None,
    "russian_roulette": True,
    "filter": None,
    "aovs": (),
    "shutter": 0.0,
    "shutter_keys": 5,
    "device": "auto",
    "gpu_memory": None,
    "threads": None,
    "memory": None,
    "accel": None,
    "camera": None,
    "look_at": None,
    "progress": False,
}


def _request(spp: int, options: RenderOptions, **own: Any) -> tuple[dict[str, Any], ProgressArgument]:
    """The words of a request as the native half takes them."""
    unknown = set(options) - set(_DEFAULTS)
    if unknown:
        raise TypeError(f"unexpected argument {', '.join(sorted(unknown))}; there are {', '.join(sorted(_DEFAULTS))}")
    request = {**_DEFAULTS, **options}
    progress: ProgressArgument = request.pop("progress")
    camera = request["camera"]
    view = camera if isinstance(camera, CameraView) else CameraView(None if camera is None else str(camera))
    if request["look_at"] is not None:
        eye, target = request["look_at"]
        view = replace(view, look_at=(_point(eye, "look_at"), _point(target, "look_at")))
    if request["fov"] is not None:
        view = view.with_fov(request["fov"])
    if isinstance(request["aovs"], str):
        raise UsageError("a list is expected", "aovs", f'aovs=["{request["aovs"]}"]')
    request.update(camera=view.name, look_at=view.look_at, fov=view.fov, aovs=list(request["aovs"]))
    request.update({name: parse_bytes(request[name], name) for name in ("memory", "gpu_memory")})
    request.update({"spp": spp, "passes": None, "noise": None, "time_limit": None, "denoise": False, **own})
    return request, progress


def _passes(passes: tuple[int, int] | range | None) -> tuple[int, int] | None:
    if passes is None:
        return None
    if isinstance(passes, range):
        if passes.step != 1:
            raise UsageError("passes follow each other", "passes", "give a range of step 1")
        passes = (passes.start, passes.stop)
    first, end = passes
    if not 0 <= first < end:
        raise UsageError(f"({first}, {end}) has no pass", "passes", "count from 0; the second is not in it")
    return first, end


def render(
    scene: Scene,
    *,
    spp: int = 64,
    passes: tuple[int, int] | range | None = None,
    noise: float | None = None,
    time_limit: float | None = None,
    denoise: bool = False,
    **options: Unpack[RenderOptions],
) -> Image:
    """A picture of a scene. The same request gives the same bits, on any number of threads, and on the command line.

    Args:
        scene: the scene, as it is now.
        spp: samples a pixel.
        passes: only these of the samples, counted from 0: ``(a, b)`` without b, or a range.
        noise: parts of the picture are done when their relative error is this; `spp` is the most that they get.
        time_limit: seconds, after which the picture is even, with at least one sample.
        denoise: take the noise out of the colour with Open Image Denoise, where it is installed.
        options: see :class:`RenderOptions`.

    Raises:
        MemoryBudgetError: the picture does not fit; nothing was begun.
        DeviceError: the device cannot be used.
        KeyboardInterrupt: on Ctrl-C, soon.
    """
    own = {"passes": _passes(passes), "noise": noise, "time_limit": time_limit, "denoise": denoise}
    request, progress = _request(spp, options, **own)
    follower = listener(progress)
    try:
        return Image(scene._core.render(request, follower.native() if follower else None))
    finally:
        if follower:
            follower.close()


def accumulate(
    scene: Scene,
    *,
    passes: tuple[int, int] | range,
    **options: Unpack[RenderOptions],
) -> Accumulator:
    """The sums of some passes of a picture, to be added to others by :func:`merge`.

    Args:
        scene: the scene, as it is now.
        passes: samples counted from 0: ``(a, b)`` without b, or a range.
        options: see :class:`RenderOptions`.
    """
    wanted = _passes(passes)
    if wanted is None:
        raise UsageError("the passes are missing", "passes", "such as (0, 16), or a range")
    request, progress = _request(wanted[1], options, passes=wanted)
    follower = listener(progress)
    try:
        return Accumulator(scene._core.accumulate(request, follower.native() if follower else None))
    finally:
        if follower:
            follower.close()


def progressive(scene: Scene, *, max_spp: int = 256, **options: Unpack[RenderOptions]) -> Iterator[Image]:
    """Pictures with 1, 2, 4, ... samples a pixel, up to `max_spp`: the last has the bits of ``render(..., spp=max_spp)``.

    Stop when it is good enough: nothing is rendered ahead. The scene must stay as it is meanwhile.
    """
    sums = accumulate(scene, passes=(0, 1), **options)
    done = 1
    while True:
        yield sums.develop()
        if done >= max_spp:
            return
        more = min(2 * done, max_spp)
        sums = merge([sums, accumulate(scene, passes=(done, more), **options)])
        done = more


class View:
    """An interactive page at work; it ends with :meth:`close`, or at the end of a ``with``."""

    def __init__(self, native: _native.Server) -> None:
        self._native = native

    @property
    def url(self) -> str:
        """The page's address. Whoever has it can watch and steer: it holds a token."""
        return self._native.url

    def close(self) -> None:
        """Ends it."""
        self._native.close()

    def __enter__(self) -> View:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"vastlight.View {self.url}"


def view(
    scene: Scene, *, port: int = 0, host: str = "127.0.0.1", spp: int = 64, camera: str | None = None
) -> View:
    """Shows a scene on an interactive page, which a browser opens at ``.url``; it renders on threads of its own.

    The page opens the scene's source again, with the changes of looks that were made here. Scenes whose places, vertices or meshes were
    changed cannot be viewed. Command lines that are copied from the page have what :func:`load` was given, but not changes of looks that
    are in no file.

    Args:
        scene: the scene.
        port: 0 for a free one.
        host: address to listen on; any but this machine's own lets others in who have the page's address.
        spp: samples a pixel of a picture at rest.
        camera: a camera by name.
    """
    from ._changes import to_json

    changes = to_json(scene._looks.changes) if scene._looks.changes else None
    page = {"host": host, "port": port, "spp": spp, "camera": camera}
    return View(scene._core.view(page, changes))
