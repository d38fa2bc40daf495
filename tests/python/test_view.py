"""The viewer without a browser: what it loads, what it draws, what it says, and what it refuses."""
import json
import subprocess
import sys

import numpy as np
import pytest
import view_fixtures as made
from conftest import TOWEL, start, write_scene

import flash_sim
from flash_sim.view import __main__ as program
from flash_sim.view import page, recording, run, scene
from flash_sim.view.poses import matrix_of, pose_at

DOWN = [0, 0, 0.5, 1, 0, 0, 0]  # of a camera that looks down


def refused(capsys, monkeypatch, *arguments):
    """The line of a refusal."""
    monkeypatch.setattr(page, "expect_viser", lambda: None)
    assert program.main([str(argument) for argument in arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("flash_sim.view: ") and err.count("\n") == 1, err
    return err


# -- run ----------------------------------------------------------------------------------------------------------------------


def test_a_run_is_its_answer_over_what_was_seen(tmp_path):
    loaded = run.load_runs([made.write_run(tmp_path / "run")])
    motion, = loaded.motions
    assert motion.name == "lift" and motion.times.tolist() == list(made.TIMES)
    assert all(np.array_equal(*pair) for pair in zip(motion.meshes, made.LIFTED))
    assert np.array_equal(motion.triangles, made.TRIANGLES)
    assert [len(cloud) for cloud in motion.clouds] == [0, 50, 50] and np.allclose(motion.clouds[2], made.SEEN[2], atol=1e-15)
    assert np.isnan(motion.scores[0]) and motion.scores[1:].tolist() == [0.001, 0.002]
    words = loaded.words["lift"]
    for row in ("| bending | 0.00015 | 0.00014 to 0.00016 | N m |", "| young | 1e+05 | above 5e+04 | Pa |",
                "| friction | 0.3 | not identifiable |  |", "0.64 mm", "12.0, -8.0, 0.0 mm"):
        assert row in words.answer
    assert words.warnings == "young was not measured"
    assert words.candidates.index("| 1 | 0.00015 |") < words.candidates.index("| 0 | 0.0001 |") and "| 2 |" not in words.candidates
    assert "--hold bending=0.00015,young=100000,friction=0.3" in words.candidates


def test_replays_stand_beside_a_run_to_choose_from(tmp_path):
    made.write_run(tmp_path / "run")
    made.write_replay(tmp_path / "stiff", [mesh + [0, 0, 0.01] for mesh in made.LIFTED])
    loaded = run.load_runs([tmp_path / "run", tmp_path / "stiff"])
    assert [motion.name for motion in loaded.motions] == [f"{tmp_path / 'run'}: lift", str(tmp_path / "stiff")]
    assert loaded.motions[1].meshes[0][0, 2] == 0.01


def test_an_answer_that_cannot_be_used_says_so(tmp_path):
    loaded = run.load_runs([made.write_run(tmp_path / "run", exit_code=3)])
    assert "cannot be used" in loaded.words["lift"].answer


@pytest.mark.parametrize("spoil, words", [
    (lambda f: (f / "summary.json").unlink(), ["summary.json", "flash-sysid grid or fit"]),
    (lambda f: (f / "summary.json").write_text("{"), ["summary.json", "cannot be read"]),
    (lambda f: (f / "summary.json").write_text('{"schema": "flash-asset/1"}'), ["summary.json", "flash-asset/1", "expected"]),
    (lambda f: (f / "summary.json").write_text(json.dumps(made.SUMMARY | {"axes": ["poison"]})), ["summary.json", "poison"]),
    (lambda f: (f / "best/lift/overlay.csv").unlink(), ["best", "found no motion"]),
    (lambda f: (f / "best/lift/overlay.csv").write_text("t,points\n0,1\n"), ["overlay.csv", "line 1", "score_m"]),
    (lambda f: (f / "best/lift/overlay.csv").write_text("t,score_m,points\n0,x,1\n"), ["overlay.csv", "line 2", "\"x\""]),
    (lambda f: (f / "best/lift/overlay.csv").write_text("t,score_m,points\n"), ["overlay.csv", "no keyframes"]),
    (lambda f: (f / "best/lift/001_mesh.ply").unlink(), ["001_mesh.ply"]),
    (lambda f: (f / "best/lift/001_mesh.ply").write_text(made.ply(made.SQUARE[:3], [[0, 1, 2]])), ["best/lift", "vertices"]),
    (lambda f: (f / "best/lift/001_cloud.ply").write_text("ply\n"), ["001_cloud.ply"]),
    (lambda f: (f / "results.csv").unlink(), ["results.csv", "cannot be read"])])
def test_a_spoiled_run_is_refused_in_a_line_that_names_the_file(tmp_path, capsys, monkeypatch, spoil, words):
    folder = made.write_run(tmp_path / "run")
    spoil(folder)
    line = refused(capsys, monkeypatch, "run", folder)
    assert all(word in line for word in words), line


# -- recording -----------------------------------------------------------------------------------------------------------------


def test_a_recording_has_clouds_forces_and_a_gripper(tmp_path):
    loaded = recording.load_recording(made.write_recording(tmp_path / "lift"))
    assert loaded.times.tolist() == list(made.TIMES) and loaded.counts == [0, 50, 50]
    assert np.allclose(loaded.clouds[1], made.SEEN[1], atol=1e-7)  # float32 of 0.1 m
    assert loaded.forces[2] == [0, 0, -0.2]
    assert [loaded.held_by("gripper", time) for time in made.TIMES] == [False, True, True]
    words = recording.frame_words(loaded, 1)
    assert "100.0, 100.0, 50.0 mm, closed" in words and "0.000, 0.000, -0.100 N" in words and "50 points" in words


def test_a_pose_turns_evenly_between_two_and_rests_beyond(tmp_path):
    track = recording.load_recording(made.write_recording(tmp_path / "lift")).tracks["gripper"]
    for time, angle in ((0.25, np.pi / 8), (0.5, np.pi / 4), (-1, 0), (9, np.pi / 2)):
        pose = pose_at(track, time)
        expected = [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        assert np.allclose(pose[:3, :3], expected, atol=1e-12) and np.isclose(pose[2, 3], 0.1 * angle / (np.pi / 2), atol=1e-12)


def test_depth_is_seen_where_the_camera_looks(tmp_path):
    """A picture of 0.4 m everywhere, from 0.5 m above: a level square at 0.1 m, as wide as the lens says."""
    image = pytest.importorskip("PIL.Image")
    folder = made.write_camera(tmp_path / "lift")
    counts = np.full((60, 80), 400, np.uint16)
    counts[:, :8] = 0  # nothing was measured
    mask = np.ones((60, 80), np.uint8)
    mask[-1] = 0
    image.fromarray(counts).save(folder / "a.png")
    image.fromarray(mask).save(folder / "mask.png")
    np.save(folder / "b.npy", np.where(counts == 0, np.nan, 0.4))
    made.write_recording(folder / "of", trajectories={}, grasps=[], keyframes=[
        {"t": 0, "depth": "../a.png"}, {"t": 1, "depth": "../b.npy"}, {"t": 2, "depth": "../a.png", "mask": "../mask.png"}],
        camera={"intrinsics": "../camera_info.yaml", "T_base_camera": DOWN})
    loaded = recording.load_recording(folder / "of")
    assert loaded.counts == [72 * 60, 72 * 60, 72 * 59]
    assert np.allclose(loaded.clouds[0], loaded.clouds[1], atol=1e-6)
    low, high = loaded.clouds[0].min(axis=0), loaded.clouds[0].max(axis=0)
    assert np.allclose(low, [(8 - 39.5) / 70 * 0.4, -29.5 / 70 * 0.4, 0.1], atol=1e-6)
    assert np.allclose(high, [39.5 / 70 * 0.4, 29.5 / 70 * 0.4, 0.1], atol=1e-6)
    camera, = loaded.cameras
    assert np.isclose(np.tan(camera.fov / 2), 30 / 70) and np.allclose(camera.pose, matrix_of(DOWN))


def test_a_camera_is_drawn_beside_clouds(tmp_path):
    loaded = recording.load_recording(made.write_recording(tmp_path / "lift"), [made.write_camera(tmp_path / "top")])
    assert loaded.cameras[0].name == "top" and np.allclose(loaded.cameras[0].pose, matrix_of(DOWN))


def test_tracks_of_markers_are_keyframes(tmp_path):
    folder = made.write_recording(tmp_path / "beam", keyframes=[], trajectories={}, grasps=[], markers={"tracks": "tracks.csv"})
    (folder / "tracks.csv").write_text("t,marker,x,y,z\n0,A,0,0,0\n0,B,1,0,0\n0.1,A,0,0,0.5\n")
    loaded = recording.load_recording(folder)
    assert loaded.times.tolist() == [0, 0.1] and [cloud.tolist() for cloud in loaded.clouds] == [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0.5]]]


@pytest.mark.parametrize("changes, words", [
    ({"schema": "flash-scene/1"}, ["recording.json", "flash-recording/"]),
    ({"keyframes": []}, ["recording.json", "no keyframes"]),
    ({"keyframes": [{"cloud": "frames/1.ply"}]}, ["recording.json", "'t'"]),
    ({"keyframes": [{"t": 0, "cloud": "frames/9.ply"}]}, ["frames/9.ply"]),
    ({"keyframes": [{"t": 0, "depth": "0.png"}]}, ["keyframes[0].depth", "no camera"]),
    ({"trajectories": {"gripper": "recording.json"}}, ["recording.json"]),
    ({"markers": {"tracks": "gripper.tum"}}, ["gripper.tum", "line 1"]),
    ({"camera": {"intrinsics": "lens.yaml", "T_base_camera": DOWN}}, ["lens.yaml"])])
def test_a_spoiled_recording_is_refused_in_a_line_that_names_the_file(tmp_path, capsys, monkeypatch, changes, words):
    folder = made.write_recording(tmp_path / "lift", **changes)
    line = refused(capsys, monkeypatch, "recording", folder)
    assert all(word in line for word in words), line


# -- scene ---------------------------------------------------------------------------------------------------------------------


SOLID = {"schema": "flash-asset/1", "mesh": "box:0.1x0.2x0.3:0.05", "element_type": "TETRAHEDRON",
         "mechanical_props": {"density": 500, "young": 1e6, "poisson": 0.3, "constitutive": "TET_COROTATED"}}
CORNERS = [0, 5]  # of the towel of 6 x 6 vertices


def hung(folder, **changes):
    """A towel that hangs from two corners."""
    return write_scene(folder, TOWEL | {"mechanical_props": TOWEL["mechanical_props"] | {"air_drag": 20}}, obstacles={},
                       objects={"towel": {"asset": "towel.json", "start": {"T_base_object": [0, 0, 1, 0, 0, 0, 1]},
                                          "fixed": [{"name": "bar", "vertices": CORNERS}]}}, **changes)


def test_what_holds_a_towel_carries_its_weight(tmp_path):
    sim = start(hung(tmp_path))
    assert sim.forces == ["bar"]
    sim.step(600)
    weight = 0.2 * 0.2**2 * 9.81
    assert np.isclose(scene.weight_of(sim), weight, rtol=1e-2)  # of the sheet as it hangs, which is longer
    assert np.allclose(scene.forces_of(sim, 0)["bar"], [0, 0, weight], atol=0.02 * weight)  # it still swings a little
    assert np.array_equal(sim.held_places("bar"), sim.positions()[0][CORNERS])
    assert "| bar |" in scene.words_of(sim, 0, scene.forces_of(sim, 0), weight, 0.05)


def test_pictures_lie_on_the_surfaces_that_they_are_drawn_from(tmp_path):
    """Each pixel is in the plane of its triangle, of a solid, a table and a hand that has moved."""
    sim = start(write_scene(tmp_path, SOLID, timestep=0.001))
    sim.add_ee("hand", [0.2, 0.3, 0.1], size=[0.06, 0.06, 0.02])
    sim.move_ee("hand", [0.2, 0.31, 0.12, 0.6, 0, 0, 0.8])
    sim.step()
    sim.add_camera("eye", 80, 60, 70, 70, 39.5, 29.5, flash_sim.look_at([0.5, 0.4, 0.7], [0.1, 0.2, 0.1], [0, 0, 1]))
    seen = sim.render("eye", ("instance", "triangle", "points"))
    assert sim.instances == ["towel", "table", "hand"]
    for number, name in enumerate(sim.instances):
        pixels = seen["instance"][0] == number
        assert pixels.sum() > 20
        vertices, triangles = sim.surface(name)
        a, b, c = (vertices[triangles[seen["triangle"][0][pixels], k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        away = ((seen["points"][0][pixels] - a) * normals).sum(axis=1) / np.linalg.norm(normals, axis=1)
        assert np.abs(away).max() < 1e-6  # points are float32 of up to 3 m


def test_an_arrow_of_a_solid_is_its_weight(tmp_path):
    sim = start(write_scene(tmp_path, SOLID))
    assert np.isclose(scene.weight_of(sim), 500 * 0.1 * 0.2 * 0.3 * 9.81, rtol=1e-9)


def test_a_plane_is_a_square_below_what_lies_on_it(tmp_path):
    sim = start(write_scene(tmp_path, obstacles={"table": {"shape": "plane", "point": [3, 2, 0], "normal": [0, 0.6, 0.8]}}))
    box = scene.box_of(sim)
    assert np.allclose(box.low, [0, 0, 0]) and np.allclose(box.high, [0.2, 0.2, 0])
    corners, triangles = scene.drawn_surface(sim, "table", 0, box)
    heights = (corners - [3, 2, 0]) @ [0, 0.6, 0.8]
    assert np.allclose(heights, -scene.SUNK * box.size, atol=1e-9)
    assert np.allclose(np.linalg.norm(corners - corners.mean(axis=0), axis=1), scene.DRAWN_HALF * box.size)
    across = corners.mean(axis=0) - box.middle
    assert np.allclose(np.cross(across, [0, 0.6, 0.8]), 0, atol=1e-9)  # below the middle of the towel


def test_environments_differ_by_what_was_drawn(tmp_path):
    sim = scene.start(write_scene(tmp_path), 3, "published", 1)
    assert sim.n_envs == 3 and len(set(sim.material()["bending_rigidity"])) == 3


@pytest.mark.parametrize("name, text, words", [("no.json", None, ["no.json"]), ("bad.json", "{", ["bad.json"]),
                                               ("other.json", '{"schema": "flash-scene/1", "obiects": {}}', ["other.json", "obiects"])])
def test_a_spoiled_scene_is_refused_in_a_line_that_names_the_file(tmp_path, capsys, monkeypatch, name, text, words):
    if text is not None:
        (tmp_path / name).write_text(text)
    line = refused(capsys, monkeypatch, "scene", tmp_path / name)
    assert all(word in line for word in words), line


# -- the program ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments, words", [
    ((), ["run|scene|recording"]), (("film", "x"), ["film"]), (("run",), ["FOLDER"]), (("run", "x", "--port", "80000"), ["80000", "64535"]),
    (("scene", "x", "--envs", "0"), ["--envs", "1 to"]), (("scene", "x", "--randomize", "so"), ["so", "published"])])
def test_a_wrong_command_line_is_refused_in_a_line(capsys, arguments, words):
    with pytest.raises(SystemExit) as ended:
        program.main(list(arguments))
    err = capsys.readouterr().err
    assert ended.value.code == 2 and err.count("\n") == 1 and all(word in err for word in words), err


def test_without_viser_it_says_what_to_install(tmp_path):
    script = ("import sys; sys.modules['viser'] = None; import flash_sim; flash_sim.RealtimeSim; "
              "from flash_sim.view.__main__ import main; sys.exit(main(['run', 'nowhere']))")
    ended = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, text=True, cwd=tmp_path)
    assert ended.returncode == 2 and ended.stdout == "" and ended.stderr.count("\n") == 1
    assert "pip install 'flash-sim[view]'" in ended.stderr
