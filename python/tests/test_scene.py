"""What is in scenes, and changes of it."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import vastlight as vl

SMALL = (40, 30)


def colors(scene: vl.Scene) -> np.ndarray:
    return np.asarray(vl.render(scene, size=SMALL, spp=2))


def test_importing_prints_nothing_and_starts_no_threads() -> None:
    text = "import threading, vastlight; print(threading.active_count())"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("1\n", "")


def test_scenes_are_mappings_of_objects(cornell: vl.Scene) -> None:
    assert len(cornell) == len(list(cornell)) > 1
    name = next(iter(cornell))
    assert name in cornell and cornell[name].name == name
    wrong = name[:-1] + "?"
    with pytest.raises(KeyError, match="there are") as caught:
        cornell[wrong]
    assert isinstance(caught.value, vl.SceneError) and name in str(caught.value)
    assert cornell.stats()["instances"] == len(cornell.names)
    assert "demo:cornell" in repr(cornell) and name in repr(cornell[name])
    bounds = cornell.bounds
    assert bounds is not None and bounds.shape == (2, 3) and (bounds[0] < bounds[1]).all()


def test_transforms_move_objects(plane: vl.Scene) -> None:
    floor = plane["floor"]
    assert np.array_equal(floor.transform, np.eye(4))
    moved = np.eye(4)
    moved[:3, 3] = (0.0, 2.0, 0.25)
    floor.transform = moved
    assert np.array_equal(floor.transform, moved)
    hits = plane.trace([[0, 5, 0]], [[0, -1, 0]])
    assert hits.t[0] == 3.0
    assert np.array_equal(plane.bounds, [[-1, 2, -0.75], [1, 2, 1.25]])
    for wrong in (np.zeros((4, 4)), np.eye(3), np.full((4, 4), np.nan)):
        with pytest.raises(ValueError):
            floor.transform = wrong
    assert np.array_equal(floor.transform, moved)


def test_vertices_change_the_mesh(plane: vl.Scene) -> None:
    floor = plane["floor"]
    assert floor.vertices.shape == (4, 3) and floor.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    plane.trace([[0, 5, 0]], [[0, -1, 0]])
    floor.vertices = floor.vertices.astype(np.float64) + [0, 1, 0]
    assert plane.trace([[0, 5, 0]], [[0, -1, 0]]).t[0] == 4.0
    with pytest.raises(vl.SceneError, match="4 vertices"):
        floor.vertices = np.zeros((5, 3))
    with pytest.raises(vl.SceneError, match="finite"):
        floor.vertices = np.full((4, 3), np.nan)
    with pytest.raises(vl.SceneError, match="normal"):
        floor.set_vertices(floor.vertices, np.full((4, 3), np.nan))
    for number in (-1, 7, 1 << 40):
        with pytest.raises(vl.SceneError, match="does not exist"):
            plane.instance_transform(number)
    assert plane.trace([[0, 5, 0]], [[0, -1, 0]]).t[0] == 4.0


def test_an_edited_scene_is_one_built_so(plane: vl.Scene) -> None:
    plane.add_mesh("wall", vertices=[[-1, 0, -1], [1, 0, -1], [0, 2, -1]], faces=np.array([[0, 1, 2]], np.int64))
    colors(plane)
    plane["floor"].transform = np.diag([2.0, 1.0, 2.0, 1.0])
    plane.remove("wall")
    assert list(plane) == ["floor"]
    other = vl.Scene()
    other.add_mesh(
        "floor",
        vertices=plane["floor"].vertices,
        faces=plane["floor"].faces,
        transform=np.diag([2.0, 1.0, 2.0, 1.0]),
    )
    assert plane.fingerprint == other.fingerprint
    assert np.array_equal(colors(plane), colors(other))


def test_meshes_are_checked_when_they_are_added(plane: vl.Scene) -> None:
    good = {"vertices": np.eye(3), "faces": [[0, 1, 2]]}
    wrong: list[dict[str, object]] = [
        {**good, "normals": np.full((3, 3), np.nan)},
        {**good, "faces": [[0, 1, 3]]},
        {**good, "faces": [[0, 1, -1]]},
        {**good, "faces": [[0.0, 1.0, 2.0]]},
        {**good, "vertices": np.zeros((3, 2))},
        {**good, "vertices": [[np.inf, 0, 0], [1, 0, 0], [0, 1, 0]]},
        {**good, "normals": np.zeros((2, 3))},
        {**good, "uvs": np.zeros((3, 3))},
        {**good, "material": "Nothing"},
        {**good, "transform": np.zeros((4, 4))},
        {"vertices": np.eye(3)},
        {**good, "mesh": object()},
    ]
    for arguments in wrong:
        with pytest.raises(ValueError):
            plane.add_mesh("more", **arguments)  # type: ignore[arg-type]
    with pytest.raises(vl.UsageError, match="already"):
        plane.add_mesh("floor", **good)  # type: ignore[arg-type]
    assert list(plane) == ["floor"]


def test_a_mesh_that_is_refused_leaves_nothing(plane: vl.Scene) -> None:
    good = {"vertices": np.eye(3), "faces": [[0, 1, 2]]}
    red = {"base_color": [1, 0, 0]}
    before = list(plane.materials)
    wrong: list[dict[str, object]] = [
        {**good, "faces": [[0, 1, 3]], "material": red},
        {**good, "uvs": np.zeros((3, 3)), "material": red},
        {**good, "material": {"rough": 1}},
        {**good, "material": {"roughness": -1}},
    ]
    for arguments in wrong:
        with pytest.raises(ValueError):
            plane.add_mesh("ball", **arguments)  # type: ignore[arg-type]
        assert list(plane.materials) == before
    with pytest.raises(vl.SceneError, match="rough"):
        plane.add_material("x", rough=1)
    assert plane.add_material("x", roughness=1).roughness == 1
    plane.add_mesh("ball", **good, material=red)  # type: ignore[arg-type]
    assert plane.materials["ball"].base_color == [1, 0, 0]
    plane.materials["ball"].roughness = 0.25
    plane.remove("ball")
    plane.add_mesh("ball", **good, material={"metallic": 0.5})  # type: ignore[arg-type]
    ball, neutral = plane.materials["ball"], plane.materials["neutral"]
    assert (ball.base_color, ball.metallic, ball.roughness) == (neutral.base_color, 0.5, neutral.roughness)
    with pytest.raises(vl.UsageError, match="already"):
        plane.add_material("ball")
    plane.materials["*"].roughness = 0.75
    assert plane.add_material("own", roughness=0.5).roughness == 0.5
    assert plane.add_material("other").roughness == 0.75


def test_meshes_with_looks_are_taken_up_together() -> None:
    scene = vl.Scene()

    def hundred(first: int) -> float:
        start = time.monotonic()
        for number in range(first, first + 100):
            looks = {"roughness": 0.5}
            scene.add_mesh(f"m{number}", vertices=np.eye(3) + number, faces=[[0, 1, 2]], material=looks)
            assert f"m{number}" in scene.materials
        return time.monotonic() - start

    # What is there already is not taken up again.
    times = [hundred(first) for first in range(0, 1000, 100)]
    assert times[-1] < 5 * times[0] + 0.1
    assert len(scene) == 1000


def test_materials_are_changed_by_attributes(cornell: vl.Scene) -> None:
    before = colors(cornell)
    name = next(iter(cornell.materials))
    material = cornell.materials[name]
    material.roughness = 0.25
    material.update(base_color=np.array([0.1, 0.2, 0.7]), clearcoat=1)
    assert material.roughness == 0.25 and material.base_color == [0.1, 0.2, 0.7]
    assert material.values()["clearcoat"] == 1.0 and material.ior == 1.5
    changed = colors(cornell)
    assert not np.array_equal(before, changed)
    opened = vl.load(
        "demo:cornell",
        overrides={"materials": {name: {"roughness": 0.25, "base_color": [0.1, 0.2, 0.7], "clearcoat": 1.0}}},
    )
    assert np.array_equal(changed, colors(opened))
    for key, value in [("roughnes", 1), ("roughness", "rough"), ("metal", "cheese")]:
        with pytest.raises(vl.SceneError, match=key if key == "roughnes" else "invalid|cheese"):
            setattr(material, key, value)
    for key, number in [("roughness", -3), ("emission", [-1, 0, 0]), ("ior", -5)]:
        with pytest.raises(vl.SceneError, match=f"{key} must be"):
            setattr(material, key, number)
    with pytest.raises(vl.SceneError, match="strength must be"):
        cornell.environment.strength = -1
    assert np.array_equal(changed, colors(cornell))
    assert material.metal is None
    with pytest.raises(KeyError):
        cornell.materials["nothing of the kind"]
    with pytest.raises(AttributeError):
        material.colour


def test_the_environment_is_changed_and_replaced(plane: vl.Scene) -> None:
    sky = colors(plane)
    assert plane.environment.color is None and plane.environment.strength == 1.0
    plane.environment.strength = 0.5
    assert colors(plane).mean() == pytest.approx(0.5 * sky.mean(), rel=0.01)
    plane.environment.strength = 1
    assert np.array_equal(sky, colors(plane))
    plane.environment.color = (0.5, 0.5, 0.5)
    grey = colors(plane)
    with pytest.raises(TypeError):
        plane.environment.color = object()
    plane.environment.rotation = 0.0
    assert np.array_equal(grey, colors(plane))
    plane.environment.sun = (90.0, 20.0)
    assert not np.array_equal(sky, grey) and not np.array_equal(grey, colors(plane))
    plane.environment.update(color=[1, 1, 1], strength=0.5)
    assert np.array_equal(grey, colors(plane))
    with pytest.raises(vl.SceneError):
        plane.environment.map = "nowhere.exr"
    assert np.array_equal(grey, colors(plane))


def test_lights_and_materials_are_added(plane: vl.Scene) -> None:
    lamp = plane.add_light("Lamp", "spot", intensity=5.0, transform=[[1, 0, 0, 0], [0, 0, 1, 3], [0, -1, 0, 0], [0, 0, 0, 1]])
    assert list(plane.lights) == ["Lamp"] and lamp.scale == 1.0
    for wrong in ({"intensity": np.nan}, {"kind": "spot", "inner_angle": 2.0, "outer_angle": -1.0}):
        with pytest.raises(vl.SceneError):
            plane.add_light("More", **wrong)  # type: ignore[arg-type]
    for lens in ({"fov": np.nan}, {"fov": 500}, {"lens_radius": -1}, {"focus_distance": 0}):
        with pytest.raises(vl.SceneError):
            plane.add_camera("more", np.eye(4), **lens)
    lit = colors(plane)
    assert lit.max() > 0
    lamp.intensity = [10.0, 10.0, 10.0]
    assert colors(plane).mean() > lit.mean()
    plane.add_mesh("ball", vertices=np.eye(3), faces=[[0, 1, 2]], material={"base_color": [1, 0, 0], "metal": "gold"})
    assert plane.materials["ball"].metallic == 1.0
    plane.add_camera("top", [[1, 0, 0, 0], [0, 0, 1, 4], [0, -1, 0, 0], [0, 0, 0, 1]], fov=50)
    assert plane.cameras == ["top"]
    assert vl.render(plane, size=SMALL, spp=1, camera="top").stats["spp_done"] == 1


def test_time_goes_on_and_back() -> None:
    scene = vl.load("demo:walker")
    assert scene.moves and scene.time is None
    at_rest = colors(scene)
    scene.set_time(0.4)
    later = colors(scene)
    assert scene.time == pytest.approx(0.4) and not np.array_equal(at_rest, later)
    opened = vl.load("demo:walker", time=0.4)
    assert np.array_equal(later, colors(opened))
    blurred = np.asarray(vl.render(scene, size=SMALL, spp=2, shutter=0.2))
    assert not np.array_equal(blurred, later)
    assert np.array_equal(later, colors(scene))
    with pytest.raises(vl.SceneError):
        vl.load("demo:cornell").set_time(1.0)


def test_edits_do_not_lose_the_blur() -> None:
    scene = vl.load("demo:walker")
    scene.set_time(0.4)

    def blurred() -> np.ndarray:
        return np.asarray(vl.render(scene, size=SMALL, spp=2, shutter=0.2))

    first, sharp = blurred(), colors(scene)
    assert np.array_equal(blurred(), first)
    scene.set_instance_transform(0, scene.instance_transform(0))
    assert np.array_equal(blurred(), first)
    scene.add_material("unused")
    assert np.array_equal(blurred(), first)
    assert np.array_equal(colors(scene), sharp) and np.array_equal(blurred(), first)


def test_sources_that_cannot_be_opened(tmp_path: Path) -> None:
    for source in ("nowhere.glb", "demo:nothing", tmp_path):
        with pytest.raises(vl.SceneError):
            vl.load(source)
    damaged = tmp_path / "damaged.glb"
    damaged.write_bytes(b"glTF\x02\x00\x00\x00")
    with pytest.raises(vl.SceneError, match="damaged.glb"):
        vl.load(damaged)
    for size in ("much", "1e400GiB", "-5GiB", "1_0GiB", -5, 1.5, 1 << 64):
        with pytest.raises(vl.UsageError, match="texture_bytes: .*8GiB"):
            vl.load("demo:cornell", texture_bytes=size)  # type: ignore[arg-type]
    assert len(vl.load("demo:cornell", memory=np.int64(1 << 32))) > 0
    for wrong in (
        {"sun": (np.nan, 2)},
        {"sun": (0, 900)},
        {"sequence_fps": 0},
        {"sequence_fps": -1},
        {"time": np.inf},
        {"threads": -1},
        {"triangles": -1},
    ):
        with pytest.raises(vl.UsageError) as caught:
            vl.load("demo:cornell", **wrong)  # type: ignore[arg-type]
        assert caught.value.place == next(iter(wrong))
    with pytest.raises(vl.UsageError, match="threads"):
        vl.Scene(threads=-1)
    with pytest.raises(vl.MemoryBudgetError):
        vl.load("demo:statue", triangles=50_000_000, memory="200MiB")


def test_overrides_come_in_order(tmp_path: Path) -> None:
    file = tmp_path / "look.toml"
    file.write_text('[materials."*"]\nroughness = 0.9\n')
    scene = vl.load("demo:cornell", overrides=[file, {"materials": {"*": {"roughness": 0.1}}}])
    assert all(material.roughness == pytest.approx(0.1) for material in scene.materials.values())
    with pytest.raises(vl.SceneError, match="roughnes"):
        vl.load("demo:cornell", overrides={"materials": {"*": {"roughnes": 0.1}}})


def test_a_page_shows_the_scene(cornell: vl.Scene) -> None:
    import urllib.request

    with vl.view(cornell) as page:
        assert page.url.startswith("http://127.0.0.1:") and "token=" in page.url
        with urllib.request.urlopen(page.url, timeout=30) as answer:
            assert answer.status == 200
    cornell[next(iter(cornell))].transform = np.diag([2.0, 2.0, 2.0, 1.0])
    with pytest.raises(vl.UsageError, match="anew"):
        vl.view(cornell)
