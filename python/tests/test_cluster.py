"""Pictures on many workers have the bits of one machine's, whatever happens."""

import os
import random
import signal
import threading

import pytest

import vastlight as vl

distributed = pytest.importorskip("distributed")
cluster = pytest.importorskip("vastlight.cluster")

SIZE = (48, 32)
SPP = 12
WORKERS = {"threads_per_worker": 1, "processes": True, "dashboard_address": None}
SOAK = bool(os.environ.get("VASTLIGHT_SOAK"))


@pytest.fixture(scope="module")
def client():
    """Two workers of one thread each, in processes of their own."""
    with distributed.LocalCluster(n_workers=2, **WORKERS) as local, distributed.Client(local) as client:
        yield client


def serial(source, time=None, **options):
    scene = vl.load(source)
    if time is not None:
        scene.set_time(time)
    spp = options.pop("spp", SPP)
    return vl.accumulate(scene, passes=(0, spp), **{"size": SIZE, **options}).to_bytes()


@pytest.fixture(scope="module")
def still_life():
    return serial("demo:still-life")


@pytest.mark.parametrize("cut", [{}, {"passes_per_part": 5}, {"tile": (20, 17)}, {"tile": (48, 9), "passes_per_part": 7}])
def test_any_cut_gives_the_bits_of_one_machine(client, still_life, cut):
    told = []
    sums = cluster.accumulate(
        client, "demo:still-life", size=SIZE, spp=SPP, progress=lambda *n: told.append(n), **cut
    )
    assert sums.to_bytes() == still_life
    assert told[-1][0] == told[-1][1] == len(told)


def test_pictures_are_those_of_render(client):
    options = {"size": SIZE, "spp": 2, "integrator": "direct", "seed": 3, "aovs": ["normal"]}
    image = cluster.render(client, "demo:cornell", **options)
    alone = vl.render(vl.load("demo:cornell"), **options)
    assert (image.aov("normal") == alone.aov("normal")).all()
    assert image.__array__().tobytes() == alone.__array__().tobytes()


def test_photons_know_the_number_of_their_pass(client):
    options = {"size": SIZE, "spp": 4, "caustics": "photons", "photons": 4000}
    image = cluster.render(client, "demo:caustic-sphere", passes_per_part=1, **options)
    alone = vl.render(vl.load("demo:caustic-sphere"), **options)
    assert image.__array__().tobytes() == alone.__array__().tobytes()


def test_frames_come_as_they_are_done(client, tmp_path):
    times = [0.0, 0.5, 1.0, 0.5]
    options = {"size": (24, 16), "spp": 2, "tile": (24, 9), "checkpoint": tmp_path}
    done = dict(cluster.frames(client, "demo:bodies", times, load={"triangles": 30000}, **options))
    assert sorted(done) == [0, 1, 2, 3]
    scene = vl.load("demo:bodies", triangles=30000)
    pictures = []
    for number, moment in enumerate(times):
        scene.set_time(moment)
        pictures.append(vl.render(scene, size=(24, 16), spp=2).__array__().tobytes())
        assert done[number].__array__().tobytes() == pictures[-1], moment
    assert len(set(pictures)) == 3


def test_a_picture_after_frames_is_of_the_scene_at_rest():
    options = {"size": (24, 16), "spp": 1}
    load = {"triangles": 30000}
    with distributed.LocalCluster(n_workers=1, **WORKERS) as local, distributed.Client(local) as client:
        dict(cluster.frames(client, "demo:bodies", [1.0], load=load, **options))
        sums = cluster.accumulate(client, "demo:bodies", load=load, **options).to_bytes()
    scene = vl.load("demo:bodies", **load)
    assert sums == vl.accumulate(scene, passes=(0, 1), size=(24, 16)).to_bytes()
    scene.set_time(1.0)
    assert sums != vl.accumulate(scene, passes=(0, 1), size=(24, 16)).to_bytes()


def test_checkpoints_know_what_was_opened(client, tmp_path):
    options = {"size": (24, 16), "spp": 1, "checkpoint": tmp_path}
    cluster.accumulate(client, "demo:terrain", load={"triangles": 20000, "memory": "1GiB"}, **options)
    cluster.accumulate(client, "demo:terrain", load={"triangles": 20000, "memory": "2GiB"}, **options)
    with pytest.raises(vl.SceneError, match="another job"):
        cluster.accumulate(client, "demo:terrain", load={"triangles": 20000, "sequence_fps": 12.0}, **options)


class Killer(threading.Thread):
    """Kills workers at random moments."""

    def __init__(self, local, kills):
        super().__init__()
        self.local, self.kills, self.died, self.stop = local, kills, 0, threading.Event()

    def run(self):
        chance = random.Random(7)
        while self.died < self.kills and not self.stop.wait(chance.uniform(0.2, 1.0)):
            alive = processes(self.local)
            if alive:
                os.kill(chance.choice(alive), signal.SIGKILL)
                self.died += 1


def processes(local):
    """The processes of the workers that are alive."""
    started = [nanny.process and nanny.process.pid for nanny in local.workers.values()]
    return [pid for pid in started if pid]


def test_workers_that_die_change_nothing():
    kills, died, pictures = 20 if SOAK else 2, 0, 0
    with distributed.LocalCluster(n_workers=3, **WORKERS) as local, distributed.Client(local) as client:
        while died < kills:
            killer = Killer(local, kills - died)
            killer.start()
            asked = {"size": (96, 64), "spp": 48, "seed": pictures}
            sums = cluster.accumulate(client, "demo:still-life", passes_per_part=2, **asked)
            killer.stop.set()
            killer.join()
            died += killer.died
            pictures += 1
            assert sums.to_bytes() == serial("demo:still-life", **asked)
    print(f"{died} workers died in {pictures} pictures")


def test_a_worker_that_hangs_holds_nothing_up(still_life, monkeypatch):
    monkeypatch.setattr(cluster, "LOOK", 0.2)
    with distributed.LocalCluster(n_workers=2, **WORKERS) as local, distributed.Client(local) as client:
        pid = processes(local)[0]

        def hang(done, total):
            if done == 2:
                os.kill(pid, signal.SIGSTOP)

        try:
            asked = {"size": SIZE, "spp": SPP, "passes_per_part": 1}
            sums = cluster.accumulate(client, "demo:still-life", progress=hang, **asked)
        finally:
            os.kill(pid, signal.SIGCONT)
    assert sums.to_bytes() == still_life


def test_a_client_that_starts_again_goes_on(client, still_life, tmp_path):
    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    asked = {"size": SIZE, "spp": SPP, "passes_per_part": 1, "checkpoint": tmp_path / "sums"}
    with pytest.raises(KeyboardInterrupt):
        cluster.accumulate(client, "demo:still-life", progress=stop, **asked)
    told = []
    # Other parts than before.
    asked["passes_per_part"] = 3
    sums = cluster.accumulate(client, "demo:still-life", progress=lambda *n: told.append(n), **asked)
    assert sums.to_bytes() == still_life
    # Two samples are there: at most ten are left, and what they are cut into.
    assert told[-1][1] <= 5
    # What is done is not done again.
    told.clear()
    again = cluster.accumulate(client, "demo:still-life", progress=lambda *n: told.append(n), **asked)
    assert again.to_bytes() == still_life and not told
    with pytest.raises(vl.SceneError, match="another job"):
        cluster.accumulate(client, "demo:still-life", seed=1, **asked)
    with pytest.raises(vl.SceneError, match="has 12 samples"):
        cluster.accumulate(client, "demo:still-life", **{**asked, "spp": SPP - 1})
    with pytest.raises(vl.SceneError, match="tiles of None"):
        cluster.accumulate(client, "demo:still-life", tile=(48, 9), **asked)
    assert cluster.accumulate(client, "demo:still-life", **asked).to_bytes() == still_life


def test_workers_that_come_late_or_do_it_twice_change_nothing(still_life):
    with distributed.LocalCluster(n_workers=0, **WORKERS) as local, distributed.Client(local) as client:
        late = threading.Timer(1.0, lambda: local.scale(2))
        late.start()
        asked = {"size": SIZE, "spp": SPP, "passes_per_part": 3}
        both = [cluster.accumulate(client, "demo:still-life", **asked) for _ in range(2)]
        late.join()
    assert [sums.to_bytes() for sums in both] == [still_life] * 2


def test_a_worker_with_another_scene_is_refused(client, tmp_path, monkeypatch):
    mine = tmp_path / "a.ply"
    write(mine, 1.0)
    fingerprint = vl.load(mine).fingerprint
    write(mine, 2.0)
    assert vl.load(mine).fingerprint != fingerprint
    scene = type("Scene", (), {"fingerprint": fingerprint})()
    monkeypatch.setattr(vl, "load", lambda *a, **b: scene)
    with pytest.raises(vl.SceneError, match="another scene"):
        cluster.accumulate(client, mine, size=SIZE, spp=1)


def write(path, size):
    corners = [(0, 0, 0), (size, 0, 0), (0, size, 0)]
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_text(head + face + "\n".join(" ".join(map(str, c)) for c in corners) + "\n3 0 1 2\n")


@pytest.mark.parametrize("argument", [{"noise": 0.1}, {"passes": (0, 1)}, {"crop": (0, 0, 1, 1)}, {"tile": (0, 1)}, {"tile": ()}, {"passes_per_part": 0}])
def test_what_a_cluster_does_not_take_is_said(client, argument):
    with pytest.raises(vl.UsageError, match=next(iter(argument))):
        cluster.render(client, "demo:cornell", size=SIZE, spp=1, **argument)
