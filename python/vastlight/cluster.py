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
import json
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import vastlight as vl

try:
    from distributed import Client, Future, get_worker, wait
    from distributed.client import FutureCancelledError, FuturesCancelledError
    from distributed.scheduler import KilledWorker
except ImportError as error:  # pragma: no cover
    raise ImportError("vastlight.cluster needs Dask: pip install \"vastlight[cluster]\"") from error

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
"""A part that was lost as often as this is given up: its workers die of it."""
LOOK = 2.0
"""Seconds between two looks for parts that take long."""

Region = tuple[int, int, int, int]


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
        decides = [vl.__version__, self.fingerprint, self.options]
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
    def place(self) -> tuple[float | None, Region | None]:
        """Parts of one place differ in their passes alone."""
        return self.time, self.region

    def key(self, job: Job) -> str:
        """The name of its task."""
        text = f"{job.identity} {self.time!r} {self.region} {self.passes}"
        return f"vastlight-{hashlib.sha256(text.encode()).hexdigest()[:32]}"


def render(
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
) -> vl.Image:
    """Renders a picture on the workers of ``client``: the bits of ``vastlight.render`` on one machine.

    Args:
        source: What :func:`vastlight.load` takes. Workers open it by this name: a file on a shared disk, the address of a store, a demo.
        size: Width and height in pixels.
        spp: Samples of each pixel.
        passes_per_part: Samples of each pixel that one task takes; without it there are some tasks for each worker.
        tile: Width and height of tiles, for pictures of which one part would be too large or too slow.
        load: Further arguments of :func:`vastlight.load`.
        checkpoint: A folder for the sums so far: a client that starts again with the same arguments goes on with them.
        checkpoint_every: Seconds between two writes.
        progress: Called with parts done and parts in all.
        options: Further arguments of :func:`vastlight.render`, but ``noise``, ``passes``, ``crop`` and ``progress``.

    Raises:
        vastlight.SceneError: Workers see another scene, or the checkpoint is of another job.
    """
    plan = dict(passes_per_part=passes_per_part, tile=tile, load=load, checkpoint=checkpoint)
    plan |= dict(checkpoint_every=checkpoint_every, progress=progress)
    return accumulate(client, source, size=size, spp=spp, **plan, **options).develop()


def accumulate(client: Client, source: str | os.PathLike[str], **arguments: Any) -> vl.Accumulator:
    """The sums of :func:`render`, with the same arguments."""
    for _, sums in _places(client, source, [None], **arguments):
        return sums
    raise AssertionError("a picture has a part")


def frames(
    client: Client, source: str | os.PathLike[str], times: Iterable[float], **arguments: Any
) -> Iterator[tuple[int, vl.Image]]:
    """Renders moments of a scene that moves; gives ``(number, image)`` as frames are done, in any order.

    Args:
        times: Moments in seconds.
        arguments: Those of :func:`render`.
    """
    times = list(times)
    numbers: dict[float, list[int]] = {}
    for number, moment in enumerate(times):
        numbers.setdefault(moment, []).append(number)
    for moment, sums in _places(client, source, list(numbers), **arguments):
        for number in numbers[moment]:
            yield number, sums.develop()


def _places(
    client: Client,
    source: str | os.PathLike[str],
    times: Sequence[float | None],
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
) -> Iterator[tuple[Any, vl.Accumulator]]:
    """The sums of each moment, when they are whole."""
    for argument in ("noise", "passes", "crop", "progress", "threads"):
        if argument in options:
            raise vl.UsageError("a cluster does not take it", argument, "leave it out")
    source, load = os.fspath(source), dict(load or {})
    options = {"size": tuple(size), **options}
    job = Job(source, load, options, vl.load(source, **load).fingerprint)
    regions: list[Region | None] = list(_tiles(size, tile)) if tile else [None]
    step = passes_per_part or _passes_per_part(client, spp, len(regions) * len(times))
    ranges = [(first, min(first + step, spp)) for first in range(0, spp, step)]
    keep = Checkpoint(job, checkpoint, checkpoint_every)
    sums = {(moment, region): keep.read((moment, region)) for moment in times for region in regions}
    parts = [
        Part(moment, region, passes)
        for moment in times
        for region in regions
        for passes in _missing(sums[moment, region], ranges)
    ]
    total = len(parts)
    done = 0
    left = {place: sum(part.place == place for part in parts) for place in sums}

    def whole(moment: float | None) -> vl.Accumulator:
        return vl.merge([sums.pop((moment, region)) for region in regions])

    for moment in times:
        if not any(left[moment, region] for region in regions):
            yield moment, whole(moment)
    try:
        for part, result in _results(client, job, parts):
            known, new = sums[part.place], vl.Accumulator.from_bytes(result)
            sums[part.place] = vl.merge([known, new]) if known else new
            left[part.place] -= 1
            done += 1
            keep.note(part.place)
            keep.write(sums)
            if progress:
                progress(done, total)
            if not any(left[part.time, region] for region in regions):
                keep.write(sums, now=True)
                yield part.time, whole(part.time)
    finally:
        keep.write(sums, now=True)


def _tiles(size: tuple[int, int], tile: tuple[int, int]) -> Iterator[Region]:
    (width, height), (columns, rows) = size, tile
    if columns < 1 or rows < 1:
        raise vl.UsageError("at least one pixel is expected", "tile")
    for y in range(0, height, rows):
        for x in range(0, width, columns):
            yield x, y, min(x + columns, width), min(y + rows, height)


def _passes_per_part(client: Client, spp: int, places: int) -> int:
    parts = max(1, PARTS_PER_WORKER * max(1, len(client.nthreads())) // places)
    return -(-spp // parts)


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

    def __init__(self, job: Job, folder: str | os.PathLike[str] | None, every: float) -> None:
        self.folder = None if folder is None else Path(folder)
        self.every = every
        self.due = time.monotonic() + every
        self.changed: set[tuple[float | None, Region | None]] = set()
        if self.folder is not None:
            self._claim(self.folder, job)

    def _claim(self, folder: Path, job: Job) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / self.JOB
        mine = {"job": job.identity, "source": job.source, "options": repr(job.options)}
        if file.exists():
            known = json.loads(file.read_text())
            if known.get("job") != job.identity:
                what = f"the checkpoint is of another job, {known.get('source')} with {known.get('options')}"
                raise vl.SceneError(what, str(folder), "name another, or remove it")
            return
        new = file.with_suffix(".new")
        new.write_text(json.dumps(mine, indent=1))
        new.replace(file)

    def _file(self, folder: Path, place: tuple[float | None, Region | None]) -> Path:
        moment, region = place
        words = ["rest" if moment is None else f"{moment!r}s", *map(str, region or ["whole"])]
        return folder / f"{'-'.join(words)}.vlc"

    def read(self, place: tuple[float | None, Region | None]) -> vl.Accumulator | None:
        """What there is of a place."""
        file = self.folder and self._file(self.folder, place)
        return vl.Accumulator.load(file) if file and file.exists() else None

    def note(self, place: tuple[float | None, Region | None]) -> None:
        """There is more of a place."""
        self.changed.add(place)

    def write(self, sums: Mapping[Any, vl.Accumulator | None], now: bool = False) -> None:
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
    waiting, running = deque(parts), dict[Future, tuple[Part, float]]()
    lost, longest, done = dict[Part, int](), 0.0, set[Part]()

    def submit(part: Part, name: str = "", workers: list[str] | None = None) -> None:
        future = client.submit(
            _sums_of, job, part, key=part.key(job) + name, workers=workers, allow_other_workers=workers is not None
        )
        running[future] = part, time.monotonic()

    try:
        while waiting or running:
            while waiting and len(running) < AHEAD * max(1, len(client.nthreads())):
                submit(waiting.popleft())
            for future in _ended(running):
                part, _ = running.pop(future)
                result = _result(future)
                if part in done:
                    continue
                if result is None:
                    lost[part] = lost.get(part, 0) + 1
                    if lost[part] >= ATTEMPTS:
                        raise vl.Error(f"{ATTEMPTS} workers that had it died", str(part), "give workers more memory")
                    submit(part, f"-lost-{lost[part]}")
                    continue
                done.add(part)
                sums, seconds = result
                longest = max(longest, seconds)
                yield part, sums
            if not waiting and done:
                _double(client, running, submit, 2.0 * longest)
    finally:
        client.cancel(list(running))


def _ended(running: Mapping[Future, Any]) -> list[Future]:
    try:
        wait(list(running), timeout=LOOK, return_when="FIRST_COMPLETED")
    except (TimeoutError, FuturesCancelledError):
        pass
    return [future for future in running if future.status != "pending"]


def _result(future: Future) -> tuple[bytes, float] | None:
    """The result of a task that ended, none if its worker or the scheduler was lost."""
    try:
        return future.result()
    except (KilledWorker, FutureCancelledError):
        return None


def _double(client: Client, running: dict[Future, Any], submit: Callable[..., None], longest: float) -> None:
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
        scene = _open(job)
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


def _open(job: Job) -> vl.Scene:
    """The scene, which a worker keeps for its next part."""
    load = dict(job.load)
    if os.environ.get(MEMORY):
        load["memory"] = os.environ[MEMORY]
    source = job.source
    if os.environ.get(FOLDER) and "://" not in source and not source.startswith("demo:"):
        source = os.path.join(os.environ[FOLDER], source)
    name = repr((source, sorted(load.items())))
    if name not in _opened:
        _opened.clear()
        scene = vl.load(source, **load)
        _opened[name] = scene, scene.fingerprint
    scene, fingerprint = _opened[name]
    if fingerprint != job.fingerprint:
        _opened.clear()
        raise vl.SceneError("a worker sees another scene than the client", source, "share or copy the file")
    return scene
