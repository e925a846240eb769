"""Pictures."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import vastlight as vl

SMALL = (48, 32)


def test_a_picture_is_an_array(cornell: vl.Scene) -> None:
    image = vl.render(cornell, size=SMALL, spp=2, aovs=["normal", "depth", "alpha", "object"])
    color = np.asarray(image)
    assert color.shape == (32, 48, 3) == image.shape and color.dtype == np.float32
    assert np.isfinite(color).all() and color.mean() > 0.01
    assert image.aov("normal").shape == (32, 48, 3)
    assert image.aov("depth").shape == image.aov("alpha").shape == (32, 48)
    assert image.aov("object").shape[:2] == (32, 48)
    assert image.stats["spp_done"] == 2 and image.stats["device"] in ("cpu", "gpu")
    assert np.array(image, dtype=np.float64).dtype == np.float64
    with pytest.raises(vl.UsageError, match="albedo"):
        image.aov("albedo")


def test_pictures_are_the_command_lines(
    cornell: vl.Scene, command: Callable[..., None], tmp_path: Path
) -> None:
    given = ["-r", "48x32", "--spp", "5", "--seed", "7", "--max-depth", "6", "--device", "cpu", "-q"]
    image = vl.render(
        cornell, size=SMALL, spp=5, seed=7, max_depth=6, device="cpu", aovs=["normal", "depth"], threads=1
    )
    command("render", "demo:cornell", "-o", tmp_path / "c.exr", "--aov", "normal,depth", *given)
    command("render", "demo:cornell", "-o", tmp_path / "c.png", "--exposure", "0.5", *given)
    image.save(tmp_path / "p.exr")
    image.save(tmp_path / "p.png", exposure=0.5)
    for kind in ("exr", "png"):
        assert (tmp_path / f"p.{kind}").read_bytes() == (tmp_path / f"c.{kind}").read_bytes(), kind


@pytest.mark.parametrize(
    ("options", "flags"),
    [
        ({"integrator": "photon-caustics", "photons": 4096}, ["--integrator", "photon-caustics", "--photons", "4096"]),
        ({"caustics": "photons", "photons": 4096}, ["--caustics", "photons", "--photons", "4096"]),
        ({"look_at": ((1, 1, 3), (0, 0.5, 0)), "fov": 30}, ["--look-at", "1,1,3,0,0.5,0", "--fov", "30"]),
        ({"crop": (3, 4, 20, 30), "filter": "gaussian:2"}, ["--crop", "3,4,20,30", "--filter", "gaussian:2"]),
    ],
)
def test_options_are_those_of_the_command_line(
    options: dict[str, object], flags: list[str], command: Callable[..., None], tmp_path: Path
) -> None:
    scene = vl.load("demo:caustic-sphere")
    vl.render(scene, size=SMALL, spp=2, device="cpu", **options).save(tmp_path / "p.exr")  # type: ignore[arg-type]
    given = ["-r", "48x32", "--spp", "2", "--device", "cpu", "-q"]
    command("render", "demo:caustic-sphere", "-o", tmp_path / "c.exr", *given, *flags)
    assert (tmp_path / "p.exr").read_bytes() == (tmp_path / "c.exr").read_bytes()


def test_files_by_extension(cornell: vl.Scene, tmp_path: Path) -> None:
    image = vl.render(cornell, size=SMALL, spp=1)
    image.save(str(tmp_path / "a.jpg"))
    assert (tmp_path / "a.jpg").read_bytes() == image.encode("jpg")
    assert image.encode("png").startswith(b"\x89PNG") and image.encode("exr")[:4] == b"\x76\x2f\x31\x01"
    assert image._repr_png_() == image.encode()
    with pytest.raises(vl.UsageError, match="unknown kind"):
        image.save(tmp_path / "a.tga")
    with pytest.raises(vl.OutputError):
        image.save(tmp_path / "none" / "a.png")


def test_passes_add_up_to_the_picture(cornell: vl.Scene) -> None:
    whole = np.asarray(vl.render(cornell, size=SMALL, spp=6))
    parts = [vl.accumulate(cornell, size=SMALL, passes=passes) for passes in [(0, 2), (2, 3), range(3, 6)]]
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        merged = vl.merge([parts[i] for i in order])
        assert merged.passes == [range(6)]
        assert np.array_equal(np.asarray(merged.develop()), whole)
    sent = vl.Accumulator.from_bytes(parts[1].to_bytes())
    assert sent.to_bytes() == parts[1].to_bytes() == pickle.loads(pickle.dumps(parts[1])).to_bytes()
    assert sent.recipe == parts[0].recipe and "scene" in sent.recipe
    assert np.array_equal(np.asarray(vl.merge([parts[0], sent, parts[2]]).develop()), whole)
    assert np.array_equal(
        np.asarray(vl.render(cornell, size=SMALL, spp=6, passes=(2, 3))), np.asarray(sent.develop())
    )


def test_sums_are_files_of_the_command_line(
    cornell: vl.Scene, command: Callable[..., None], tmp_path: Path
) -> None:
    vl.accumulate(cornell, size=SMALL, passes=(0, 2), device="cpu").save(tmp_path / "a.vlc")
    flags = ["-r", "48x32", "--spp", "4", "--device", "cpu", "-q"]
    command("render", "demo:cornell", "-o", tmp_path / "b.vlc", "--passes", "3-4", *flags)
    command("merge", tmp_path / "b.vlc", tmp_path / "a.vlc", "-o", tmp_path / "c.exr", "-q")
    vl.merge([tmp_path / "a.vlc", tmp_path / "b.vlc"]).develop().save(tmp_path / "p.exr")
    assert (tmp_path / "p.exr").read_bytes() == (tmp_path / "c.exr").read_bytes()


def test_sums_that_do_not_belong_together_are_refused(cornell: vl.Scene) -> None:
    first = vl.accumulate(cornell, size=SMALL, passes=(0, 1))
    for other in (
        vl.accumulate(cornell, size=SMALL, passes=(0, 1)),
        vl.accumulate(cornell, size=SMALL, passes=(1, 2), seed=3),
        vl.accumulate(vl.load("demo:still-life"), size=SMALL, passes=(1, 2)),
    ):
        with pytest.raises(vl.SceneError):
            vl.merge([first, other])
    with pytest.raises(vl.SceneError, match="ends early"):
        vl.Accumulator.from_bytes(first.to_bytes()[:50])
    with pytest.raises(vl.UsageError):
        vl.merge([])
    with pytest.raises(vl.UsageError):
        vl.accumulate(cornell, passes=(3, 3))


def test_progressive_pictures_end_with_the_whole_one(cornell: vl.Scene) -> None:
    images = list(vl.progressive(cornell, size=SMALL, max_spp=6))
    assert [image.stats["spp_done"] for image in images] == [1, 2, 4, 6]
    assert np.array_equal(np.asarray(images[-1]), np.asarray(vl.render(cornell, size=SMALL, spp=6)))


def test_progress_is_told_and_may_end_the_work(cornell: vl.Scene) -> None:
    told: list[vl.Progress] = []

    def stop(progress: vl.Progress) -> None:
        told.append(progress)
        with pytest.raises(vl.UsageError, match="at work"):
            cornell.stats()
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        vl.render(cornell, size=(320, 200), spp=1 << 16, progress=stop)
    assert len(told) == 1 and 0 <= told[0].fraction < 1 and "spp" in str(told[0])
    assert vl.render(cornell, size=SMALL, spp=1).stats["spp_done"] == 1


def test_other_threads_go_on(cornell: vl.Scene) -> None:
    ended = threading.Event()
    count = 0

    begun = threading.Event()

    def work() -> None:
        begun.set()
        vl.render(cornell, size=(320, 200), spp=16, threads=1)
        ended.set()

    thread = threading.Thread(target=work)
    thread.start()
    begun.wait()
    start = time.monotonic()
    while not ended.is_set():
        count += 1
        time.sleep(0.001)
    thread.join()
    # Hardly ever at work if the render held the interpreter.
    assert count > 20 * (time.monotonic() - start) and count > 5


def test_threads_share_a_scene() -> None:
    scene = vl.load("demo:still-life", threads=2)
    origins = np.random.default_rng(0).normal(size=(1 << 15, 3)).astype(np.float32)
    expected = scene.trace(origins, -origins).t
    same: list[bool] = []

    def work() -> None:
        for _ in range(25):
            same.append(np.array_equal(scene.trace(origins, -origins).t, expected))

    threads = [threading.Thread(target=work, daemon=True) for _ in range(4)]
    for thread in threads:
        thread.start()
    patience = time.monotonic() + 60.0
    for thread in threads:
        thread.join(max(0.0, patience - time.monotonic()))
    assert len(same) == 100 and all(same)


def test_each_picture_has_the_device_that_it_is_asked_for(cornell: vl.Scene) -> None:
    on_cpu = vl.render(cornell, size=SMALL, spp=2, device="cpu")
    try:
        on_gpu = vl.render(cornell, size=SMALL, spp=2, device="gpu")
    except vl.DeviceError as error:
        pytest.skip(f"graphics processor: {error.what}")
    again = vl.render(cornell, size=SMALL, spp=2, device="cpu")
    assert [image.stats["device"] for image in (on_cpu, on_gpu, again)] == ["cpu", "gpu", "cpu"]
    assert np.array_equal(np.asarray(on_cpu), np.asarray(again))
    assert np.asarray(on_gpu).mean() == pytest.approx(np.asarray(on_cpu).mean(), rel=1e-3)


WAITING = """
import signal, threading
import vastlight as vl
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = vl.load("demo:cornell")
begun, stop = threading.Event(), threading.Event()

def progress(_):
    begun.set()
    if stop.is_set():
        raise LookupError

def work():
    try:
        vl.render(scene, size=(640, 400), spp=1 << 20, progress=progress)
    except LookupError:
        print("stopped", flush=True)

thread = threading.Thread(target=work)
thread.start()
begun.wait()
for call in (scene.stats, lambda: vl.render(scene, size=(16, 16), spp=1)):
    try:
        print("waits", flush=True)
        call()
    except KeyboardInterrupt:
        print("interrupted", flush=True)
stop.set()
thread.join()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals: of Unix")
def test_ctrl_c_ends_waiting_for_another_threads_render() -> None:
    process = subprocess.Popen([sys.executable, "-c", WAITING], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    patience = threading.Timer(60.0, process.kill)
    patience.start()
    try:
        for _ in range(2):
            assert process.stdout.readline() == "waits\n"
            time.sleep(0.3)
            process.send_signal(signal.SIGINT)
            assert process.stdout.readline() == "interrupted\n"
        assert process.communicate()[0] == "stopped\n"
    finally:
        patience.cancel()
        process.kill()
        process.wait()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="fork: of Unix")
def test_a_forked_process_renders(cornell: vl.Scene) -> None:
    before = np.asarray(vl.render(cornell, size=SMALL, spp=1, device="cpu"))
    child = os.fork()
    if child == 0:
        after = np.asarray(vl.render(cornell, size=SMALL, spp=1, device="cpu"))
        os._exit(0 if np.array_equal(before, after) else 1)
    assert os.waitpid(child, 0)[1] == 0


INTERRUPTED = """
import signal
import vastlight as vl
# Whoever started the tests may have told it to ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = vl.load("demo:cornell")
print("ready", flush=True)
try:
    vl.render(scene, size=(640, 400), spp=1 << 20, progress=lambda p: print("at work", flush=True))
except KeyboardInterrupt:
    image = vl.render(scene, size=(16, 16), spp=1)
    print("interrupted", image.size, flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals: of Unix")
def test_ctrl_c_ends_a_render() -> None:
    process = subprocess.Popen([sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    while "at work" not in process.stdout.readline():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=60)
    assert out.splitlines()[-1] == "interrupted (16, 16)"


def test_wrong_requests_are_one_clear_line(cornell: vl.Scene) -> None:
    wrong: list[tuple[dict[str, object], str]] = [
        ({"size": (0, 5)}, "size"),
        ({"spp": 0}, "spp"),
        ({"integrator": "magic"}, "whitted"),
        ({"device": "tpu"}, "gpu:N"),
        ({"aovs": ["beauty"]}, "albedo"),
        ({"aovs": "normal"}, "list"),
        ({"fov": 200}, "179"),
        ({"crop": (90, 90, 99, 99), "size": SMALL}, "crop"),
        ({"look_at": ((0, 0, 0), (0, 0, 0))}, "apart"),
        ({"passes": (3, 9), "spp": 4}, "passes"),
        ({"shutter": 0.1}, "set_time"),
        ({"caustics": "photons", "integrator": "ao"}, "path"),
        ({"spp": -1}, "spp"),
        ({"spp": 1 << 40}, "spp"),
        ({"spp": "many"}, "spp"),
        ({"size": (-8, 8)}, "size"),
        ({"crop": (-1, 0, 8, 8)}, "crop"),
        ({"threads": -1}, "threads"),
        ({"noise": float("inf")}, "noise"),
        ({"photon_radius": float("inf")}, "photon_radius"),
        ({"gpu_memory": "much"}, "gpu_memory"),
    ]
    for options, expected in wrong:
        with pytest.raises(ValueError, match=expected) as caught:
            vl.render(cornell, **options)  # type: ignore[arg-type]
        assert isinstance(caught.value, vl.Error) and "\n" not in str(caught.value)
    with pytest.raises(vl.UsageError, match="passes"):
        vl.accumulate(cornell, passes=None)  # type: ignore[arg-type]
    with pytest.raises(vl.UsageError, match="port"):
        vl.view(cornell, port=-1)
    with pytest.raises(vl.SceneError, match="no camera"):
        vl.render(cornell, camera="nobody")
    with pytest.raises(TypeError, match="samples"):
        vl.render(cornell, samples=3)  # type: ignore[call-arg]
    with pytest.raises(vl.MemoryBudgetError) as caught:
        vl.render(cornell, size=(8000, 8000), memory="64MiB")
    assert caught.value.hint and pickle.loads(pickle.dumps(caught.value)).args == caught.value.args


def test_a_camera_may_be_chosen(cornell: vl.Scene) -> None:
    name = cornell.cameras[0]
    whole = np.asarray(vl.render(cornell, size=SMALL, spp=1))
    assert np.array_equal(whole, np.asarray(vl.render(cornell, size=SMALL, spp=1, camera=cornell.camera(name))))
    close = vl.render(cornell, size=SMALL, spp=1, camera=cornell.camera().with_fov(10))
    assert not np.array_equal(whole, np.asarray(close))
    seen = cornell.look_at([0, 1, 4], (0, 1, 0), fov=30)
    same = vl.render(cornell, size=SMALL, spp=1, look_at=((0, 1, 4), (0, 1, 0)), fov=30)
    assert np.array_equal(np.asarray(vl.render(cornell, size=SMALL, spp=1, camera=seen)), np.asarray(same))
    with pytest.raises(KeyError):
        cornell.camera("nobody")
