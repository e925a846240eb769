"""Pictures on many machines, through Dask.

    from distributed import Client
    import vastlight.cluster as cluster

    client = Client("scheduler:8786")
    image = cluster.render(client, "/shared/house.vls", size=(1920, 1080), spp=1024, checkpoint="house-sums")

A picture is cut into parts: ranges of passes, tiles, frames. A part is a task whose name follows from what it computes, so it may be done
twice, late, or again after its worker died; its result is exact sums. Sums are added as they come, and the picture has the bits of one machine's,
whatever happened on the way. Workers open the scene themselves, each within its own memory budget.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import vastlight as vl

try:
    from distributed import Client, Future, TimeoutError, get_worker, wait
    from distributed.client import FutureCancelledError, FuturesCancelledError
    from distributed.scheduler import KilledWorker
except ImportError as error:  # pragma: no cover
    raise ImportError("vastlight.cluster needs Dask: pip install \"vastlight[cluster]\"") from error

if TYPE_CHECKING:
    Task = Future[Any]

__all__ = ["accumulate", "frames", "render"]

MEMORY = "VASTLIGHT_MEMORY"
"""Environment of a worker: its memory budget, such as ``8GiB``."""
FOLDER = "VASTLIGHT_SCENES"
"""Environment of a worker: where it finds scenes that are named by relative paths."""

PARTS_PER_WORKER = 4
"""Parts of a picture for each worker, if nobody says how many passes a part has."""
AHEAD = 2
"""Tasks that are handed out for each worker; more wait here, for workers that come later."""
ATTEMPTS = 50
"""A part that Dask gave up as often as this is given up here: its workers die of it."""
HERE_ALONE = ("memory", "threads", "cache_dir")
"""Arguments of :func:`vastlight.load` that change no picture."""
LOOK = 2.0
"""Seconds between two looks for parts that take long."""

Region = tuple[int, int, int, int]
Place = tuple[float | None, Region | None]
"""A moment and a tile of it: sums of one place are added, tiles of a moment put side by side."""


@dataclass(frozen=True)
class Job:
    """What is rendered, of what."""

    source: str
    load: dict[str, Any]
    """Keyword arguments of :func:`vastlight.load`."""
    options: dict[str, Any]
    """Keyword arguments of :func:`vastlight.accumulate`."""
    fingerprint: str
    """What must be in the scene that workers open."""

    @property
    def identity(self) -> str:
        """A name that follows from what decides the bits of a sample."""
        load = {name: value for name, value in self.load.items() if name not in HERE_ALONE}
        decides = [vl.__version__, self.fingerprint, load, self.options]
        text = json.dumps(decides, sort_keys=True, default=repr)
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class Part:
    """A part of a job, done by one worker at a time."""

    time: float | None
    """The moment, in seconds."""
    region: Region | None
    """Pixels, half open: x0, y0, x1, y1; all for ``None``."""
    passes: tuple[int, int]
    """Samples of each pixel, half open, from 0."""

    @property
    def place(self) -> Place:
        """Parts of one place differ in their passes alone."""
        return self.time, self.region

    def key(self, job: Job) -> str:
        """The name of its task."""
        text = f"{job.identity} {self.time!r} {self.region} {self.passes}"
        return f"vastlight-{hashlib.sha256(text.encode()).hexdigest()[:32]}"


def render(client: Client, source: str | os.PathLike[str], **arguments: Any) -> vl.Image:
    """Renders a picture on the workers of ``client``: the bits of :func:`vastlight.render` on one machine.

    Args:
        client: of any Dask cluster.
        source: what :func:`vastlight.load` takes; workers open it by this name: a file on a shared disk, the address of a store, a demo.
        arguments: see :func:`accumulate`.

    Raises:
        SceneError: workers see another scene, or the checkpoint is of another job.
    """
    return accumulate(client, source, **arguments).develop()


def accumulate(
    client: Client,
    source: str | os.PathLike[str],
    *,
    size: tuple[int, int],
    spp: int,
    passes_per_part: int | None = None,
    tile: tuple[int, int] | None = None,
    load: Mapping[str, Any] | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: float = 60.0,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> vl.Accumulator:
    """The sums of a picture that is rendered on the workers of ``client``.

    Args:
        client: of any Dask cluster.
        source: see :func:`render`.
        size: width and height in pixels.
        spp: samples of each pixel.
        passes_per_part: samples of each pixel that one task takes; without it there are some tasks for each worker.
        tile: width and height of tiles, for pictures of which one part would be too large or too slow.
        load: further arguments of :func:`vastlight.load`.
        checkpoint: a folder for the sums so far: a client that starts again with the same arguments goes on with them, also to more ``spp`` and in other
            parts, but of the same tiles.
        checkpoint_every: seconds between two writes.
        progress: called with parts done and parts in all.
        options: further ones of :class:`vastlight.RenderOptions`, but ``crop``, ``progress`` and ``threads``.
    """
    cut = Cut(spp, passes_per_part, tile)
    work = _work(client, source, [None], size, cut, load, checkpoint, checkpoint_every, options)
    return next(sums for _, sums in work.run(client, progress))


def frames(
    client: Client,
    source: str | os.PathLike[str],
    times: Iterable[float],
    *,
    size: tuple[int, int],
    spp: int,
    passes_per_part: int | None = None,
    tile: tuple[int, int] | None = None,
    load: Mapping[str, Any] | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: float = 60.0,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> Iterator[tuple[int, vl.Image]]:
    """Renders moments of a scene that moves; gives ``(number, image)`` as frames are done, in any order.

    Args:
        times: moments in seconds; numbers count them from 0.
        client, source, size, spp, passes_per_part, tile, load, checkpoint, checkpoint_every, progress, options: see :func:`accumulate`.
    """
    numbers: dict[float | None, list[int]] = {}
    for number, moment in enumerate(map(float, times)):
        numbers.setdefault(moment, []).append(number)
    cut = Cut(spp, passes_per_part, tile)
    work = _work(client, source, list(numbers), size, cut, load, checkpoint, checkpoint_every, options)
    for done, sums in work.run(client, progress):
        for number in numbers[done]:
            yield number, sums.develop()


@dataclass(frozen=True)
class Cut:
    """How pictures are cut into parts."""

    spp: int
    passes_per_part: int | None
    tile: tuple[int, int] | None

    def regions(self, size: tuple[int, int]) -> list[Region | None]:
        """The tiles."""
        return [None] if self.tile is None else list(_tiles(size, self.tile))

    def ranges(self, places: int, workers: int) -> list[tuple[int, int]]:
        """The ranges of passes."""
        parts = max(1, PARTS_PER_WORKER * max(1, workers) // places)
        step = -(-self.spp // parts) if self.passes_per_part is None else self.passes_per_part
        if self.spp < 1 or step < 1:
            raise vl.UsageError("at least one sample is expected", "spp" if self.spp < 1 else "passes_per_part")
        return [(first, min(first + step, self.spp)) for first in range(0, self.spp, step)]


def _work(
    client: Client,
    source: str | os.PathLike[str],
    times: list[float | None],
    size: tuple[int, int],
    cut: Cut,
    load: Mapping[str, Any] | None,
    checkpoint: str | os.PathLike[str] | None,
    checkpoint_every: float,
    options: dict[str, Any],
) -> Work:
    for argument in ("noise", "passes", "crop", "threads"):
        if argument in options:
            raise vl.UsageError("a cluster does not take it", argument, "leave it out")
    source, load = os.fspath(source), dict(load or {})
    fingerprint = vl.load(source, **load).fingerprint
    job = Job(source, load, {"size": tuple(size), **options}, fingerprint)
    return Work(job, times, size, cut, len(client.nthreads()), Checkpoint(job, cut, checkpoint, checkpoint_every))


class Work:
    """Pictures under way: their sums, and the parts that are missing."""

    def __init__(
        self,
        job: Job,
        times: list[float | None],
        size: tuple[int, int],
        cut: Cut,
        workers: int,
        checkpoint: Checkpoint,
    ) -> None:
        self.job, self.times, self.regions, self.checkpoint = job, times, cut.regions(size), checkpoint
        ranges = cut.ranges(len(self.regions) * len(times), workers)
        self.sums = {place: checkpoint.read(place, cut.spp) for place in itertools.product(times, self.regions)}
        self.parts = [Part(*place, passes) for place in self.sums for passes in _missing(self.sums[place], ranges)]
        self.left = Counter(part.time for part in self.parts)

    def run(
        self, client: Client, progress: Callable[[int, int], None] | None
    ) -> Iterator[tuple[float | None, vl.Accumulator]]:
        """The sums of each moment, when they are whole."""
        try:
            for moment in self.times:
                if not self.left[moment]:
                    yield moment, self._whole(moment)
            for done, (part, result) in enumerate(_results(client, self.job, self.parts), 1):
                self._add(part, vl.Accumulator.from_bytes(result))
                if progress:
                    progress(done, len(self.parts))
                if not self.left[part.time]:
                    self.checkpoint.write(self.sums, now=True)
                    yield part.time, self._whole(part.time)
        finally:
            self.checkpoint.write(self.sums, now=True)

    def _add(self, part: Part, new: vl.Accumulator) -> None:
        known = self.sums[part.place]
        self.sums[part.place] = vl.merge([known, new]) if known else new
        self.left[part.time] -= 1
        self.checkpoint.note(part.place)
        self.checkpoint.write(self.sums)

    def _whole(self, moment: float | None) -> vl.Accumulator:
        tiles = [self.sums.pop((moment, region)) for region in self.regions]
        return vl.merge([tile for tile in tiles if tile])


def _tiles(size: tuple[int, int], tile: tuple[int, int]) -> Iterator[Region]:
    if len(tile) != 2 or min(tile) < 1:
        raise vl.UsageError("a width and a height of at least one pixel are expected", "tile")
    (width, height), (columns, rows) = size, tile
    for y in range(0, height, rows):
        for x in range(0, width, columns):
            yield x, y, min(x + columns, width), min(y + rows, height)


def _missing(
    sums: vl.Accumulator | None, ranges: Sequence[tuple[int, int]]
) -> Iterator[tuple[int, int]]:
    """What of the ranges is not in the sums."""
    for start, end in ranges:
        for known in sums.passes if sums else []:
            if known.stop <= start or known.start >= end:
                continue
            if start < known.start:
                yield start, known.start
            start = known.stop
        if start < end:
            yield start, end


class Checkpoint:
    """The sums of a job in a folder, a file for each frame and tile."""

    JOB = "job.json"

    def __init__(self, job: Job, cut: Cut, folder: str | os.PathLike[str] | None, every: float) -> None:
        self.folder = None if folder is None else Path(folder)
        self.every = every
        self.due = time.monotonic() + every
        self.changed: set[Place] = set()
        if self.folder is not None:
            self._claim(self.folder, job, cut)

    def _claim(self, folder: Path, job: Job, cut: Cut) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / self.JOB
        tile = None if cut.tile is None else list(cut.tile)
        mine = {"job": job.identity, "source": job.source, "options": repr(job.options), "tile": tile}
        if file.exists():
            known = json.loads(file.read_text())
            if known.get("job") != job.identity:
                what = f"the checkpoint is of another job, {known.get('source')} with {known.get('options')}"
                raise vl.SceneError(what, str(folder), "name another, or remove it")
            if known.get("tile") != tile:
                raise vl.SceneError(f"the checkpoint has tiles of {known.get('tile')}", str(folder), "ask for the same tiles")
            return
        new = file.with_suffix(".new")
        new.write_text(json.dumps(mine, indent=1))
        new.replace(file)

    def _file(self, folder: Path, place: Place) -> Path:
        moment, region = place
        words = ["rest" if moment is None else f"{moment!r}s", *map(str, region or ["whole"])]
        return folder / f"{'-'.join(words)}.vlc"

    def read(self, place: Place, spp: int) -> vl.Accumulator | None:
        """What there is of a place."""
        file = self.folder and self._file(self.folder, place)
        if not file or not file.exists():
            return None
        sums = vl.Accumulator.load(file)
        most = max(known.stop for known in sums.passes)
        if most > spp:
            raise vl.SceneError(f"the checkpoint has {most} samples of each pixel", str(file), "ask for as many, or name another")
        return sums

    def note(self, place: Place) -> None:
        """There is more of a place."""
        self.changed.add(place)

    def write(self, sums: Mapping[Place, vl.Accumulator | None], now: bool = False) -> None:
        """Writes what is new, if it is time."""
        if self.folder is None or (not now and time.monotonic() < self.due):
            return
        for place in sorted(self.changed, key=repr):
            new = sums.get(place)
            if new is not None:
                new.save(self._file(self.folder, place))
        self.changed.clear()
        self.due = time.monotonic() + self.every


def _results(client: Client, job: Job, parts: Sequence[Part]) -> Iterator[tuple[Part, bytes]]:
    """The sums of all parts, each once, as they come."""
    waiting = deque(parts)
    running: dict[Task, tuple[Part, float]] = {}
    lost: Counter[Part] = Counter()
    done: set[Part] = set()
    longest = 0.0

    def submit(part: Part, name: str = "", workers: list[str] | None = None) -> None:
        future = client.submit(
            _sums_of, job, part, key=part.key(job) + name, workers=workers, allow_other_workers=workers is not None
        )
        running[future] = part, time.monotonic()

    try:
        while len(done) < len(parts):
            while waiting and len(running) < AHEAD * max(1, len(client.nthreads())):
                submit(waiting.popleft())
            for future in _ended(client, running):
                part, _ = running.pop(future, (None, 0.0))
                if part is None or part in done:
                    continue
                result = _result(future)
                if result is None:
                    lost[part] += 1
                    if lost[part] >= ATTEMPTS:
                        raise vl.Error(f"Dask gave it up {ATTEMPTS} times since its workers died", str(part), "give workers more memory")
                    submit(part, f"-lost-{lost[part]}")
                    continue
                done.add(part)
                for other in [other for other, (same, _) in running.items() if same == part]:
                    del running[other]
                sums, seconds = result
                longest = max(longest, seconds)
                yield part, sums
            if not waiting and done:
                _double(client, running, submit, 2.0 * longest)
    finally:
        client.cancel(list(running))


def _ended(client: Client, running: Mapping[Task, Any]) -> list[Task]:
    try:
        with client.as_current():
            wait(list(running), timeout=LOOK, return_when="FIRST_COMPLETED")
    except (TimeoutError, FuturesCancelledError):
        pass
    return [future for future in running if future.status != "pending"]


def _result(future: Task) -> tuple[bytes, float] | None:
    """The result of a task that ended, none if its worker or the scheduler was lost."""
    try:
        sums, seconds = future.result()
        return sums, seconds
    except (KilledWorker, FutureCancelledError):
        return None


def _double(client: Client, running: Mapping[Task, tuple[Part, float]], submit: Callable[..., None], longest: float) -> None:
    """Gives what takes long to idle workers as well; the first result counts."""
    busy = client.processing()
    idle = [worker for worker, keys in busy.items() if not keys]
    by_part: dict[Part, list[float]] = {}
    for part, since in running.values():
        by_part.setdefault(part, []).append(since)
    late = [part for part, since in by_part.items() if len(since) == 1 and time.monotonic() - since[0] > longest]
    for part, worker in zip(late, idle):
        submit(part, "-again", [worker])


_opened: dict[str, tuple[vl.Scene, str]] = {}
_lock = threading.Lock()


def _sums_of(job: Job, part: Part) -> tuple[bytes, float]:
    """The sums of a part, and the seconds that they took: on a worker, which does one part after the other with all of its threads."""
    with _lock:
        start = time.monotonic()
        scene = _open(job, moved=part.time is not None)
        if part.time is not None:
            scene.set_time(part.time)
        options = dict(job.options, passes=part.passes, threads=_threads())
        if part.region is not None:
            options["crop"] = part.region
        sums = vl.accumulate(scene, **options).to_bytes()
        return sums, time.monotonic() - start


def _threads() -> int:
    try:
        return max(1, get_worker().state.nthreads)
    except ValueError:
        return 1


def _open(job: Job, moved: bool) -> vl.Scene:
    """The scene, which a worker keeps for its next part: one that was never moved is at rest."""
    load = {"threads": _threads(), **job.load}
    if os.environ.get(MEMORY):
        load["memory"] = os.environ[MEMORY]
    source = job.source
    if os.environ.get(FOLDER) and "://" not in source and not source.startswith("demo:"):
        source = os.path.join(os.environ[FOLDER], source)
    name = repr((source, sorted(load.items()), moved))
    if name not in _opened:
        _opened.clear()
        scene = vl.load(source, **load)
        _opened[name] = scene, scene.fingerprint
    scene, fingerprint = _opened[name]
    if fingerprint != job.fingerprint:
        _opened.clear()
        raise vl.SceneError("a worker sees another scene than the client", source, "share or copy the file")
    return scene
