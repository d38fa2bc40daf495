"""Recordings, replays, distances, likelihoods and answers: the numbers are those of the programs."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import TOWEL

import flash_sim
from flash_sim import sysid

BIN = pathlib.Path(sys.executable).parent
TRUTH = 1e-4
MESH = "sheet:0.2x0.2:0.04:one_way"


def program(*words, code=0):
    done = subprocess.run([BIN / "flash-sysid", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stdout


def read_ply(path):
    """Vertices of a binary PLY of float64 numbers."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    assert b"property double x" in head
    count = int(head.split(b"element vertex ")[1].split()[0])
    return np.frombuffer(body, "<f8", 3 * count).reshape(-1, 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A lift of known truth, a search of it, and its asset; the camera is off by 10 mm and 4 mm."""
    folder = tmp_path_factory.mktemp("sysid")
    (folder / "towel.json").write_text(json.dumps(TOWEL))
    program("synth", "--asset", folder / "towel.json", "--mesh", MESH, "--hold", f"bending={TRUTH}", "--duration", 1, "--rate", 8,
            "--resolution", "80x60", "--offset-error", "0.01,-0.004,0", "--quiet", "-o", folder / "lift")
    program("grid", folder / "lift", "--asset", folder / "towel.json", "--bending", "5e-5:2e-4:3:log", "--hold", "friction=0.3:measured",
            "--no-plan", "--no-solver-check", "--quiet", "-o", folder / "run")
    program("export", folder / "run", "--quiet", "-o", folder / "tuned.json")
    return folder


@pytest.fixture
def towel(folder):
    return folder / "towel.json"


@pytest.fixture
def lift(folder):
    return sysid.load(folder / "lift")


def test_a_recording_is_arrays(folder, lift):
    file = json.loads((folder / "lift" / "recording.json").read_text())
    assert lift.name == "lift" and lift.kind == "corner_lift" and lift.mesh == MESH and lift.asset is None
    assert lift.times.tolist() == [keyframe["t"] for keyframe in file["keyframes"]]
    assert lift.vertices.shape == lift.start.shape == (36, 3) and lift.triangles.shape == (50, 3)
    assert lift.tetrahedra.shape == (0, 4) and lift.triangles.dtype.kind == "i"
    assert len(lift.clouds) == len(lift.contours) == len(lift.markers) == 9
    assert all(cloud.shape[1:] == (3,) and len(cloud) > 100 for cloud in lift.clouds)
    assert lift.forces.shape == (9, 3) and np.isnan(lift.forces).all()
    times, poses = lift.grippers["gripper"]
    tum = np.loadtxt(folder / "lift" / "gripper.tum")
    assert np.array_equal(times, tum[:, 0]) and np.allclose(poses, tum[:, 1:], atol=1e-15)
    (grasp,) = lift.grasps
    assert grasp["gripper"] == "gripper" and grasp["to"] == np.inf and grasp["shape"] == "clamp"
    assert lift.vertices[grasp["vertices"]].min(axis=0)[:2].tolist() == pytest.approx([0.2, 0.2])
    assert lift.gravity.tolist() == [0, 0, -9.81] and lift.table[1].tolist() == [0, 0, 1]
    assert lift.bounds["offset"].shape == (3,) and lift.crop[0][2] == -np.inf
    assert "9 keyframes" in repr(lift) and len(lift.sha256) == 64
    assert sysid.load(str(folder / "lift" / "recording.json")).sha256 == lift.sha256


OF_PROGRAM = [({"bending": 5e-5}, {}, []), ({}, {}, []),
              ({"friction": 0.4, "bending": 2e-4, "start_yaw": 0.05}, {"mesh": "sheet:0.2x0.2:0.05:delaunay", "time_step": 0.02},
               ["--mesh", "sheet:0.2x0.2:0.05:delaunay", "--time-step", 0.02]),
              ({"bending": 1.3e-4}, {"grasp_shape": "point", "grasp_cell": 0.02, "tolerance": 1e-4, "iterations": 50},
               ["--grasp-shape", "point", "--grasp-cell", 0.02, "--tolerance", 1e-4, "--iterations", 50])]


@pytest.mark.parametrize("values, settings, options", OF_PROGRAM, ids=["value", "asset", "mesh", "grasp"])
def test_positions_and_scores_are_those_of_the_program(folder, lift, towel, tmp_path, values, settings, options):
    holds = [word for name, value in values.items() for word in ("--hold", f"{name}={value}")]
    said = json.loads(program("replay", folder / "lift", "--asset", towel, *holds, *options, "--every-step", "--json", "--quiet",
                              "-o", tmp_path / "out"))
    motion = sysid.replay(lift, values, asset=towel, **settings)
    steps = sorted((tmp_path / "out" / "steps").iterdir())
    assert motion.positions.shape == (len(steps), len(motion.rest), 3) and motion.times.shape == (len(steps),)
    assert all(np.array_equal(read_ply(path), positions) for path, positions in zip(steps, motion.positions))
    found = sysid.distances(lift, motion)
    assert found.score == said["score"] and found.scores.tolist() == [frame["score"] for frame in said["frames"]]
    assert found.weights.tolist() == [frame["weight"] for frame in said["frames"]]
    assert found.offset.tolist() == said["offset"] and (found.yaw, found.time_offset) == (said["yaw"], said["time_offset"])
    assert found.bounds_hit == said["bounds_hit"]
    assert (motion.converged, motion.residual_max, motion.penetration_max) == (
        said["converged"], said["residual_max"], said["penetration_max_m"])
    assert motion.accepted and all(motion.values[name] == value for name, value in values.items())
    assert motion.forces.shape == (len(steps) - 1, 3) and motion.forces[-1, 2] > 0


def test_the_program_takes_other_ways_to_score(folder, lift, towel, tmp_path):
    motion = sysid.replay(lift, {"bending": 5e-5}, asset=towel)
    for k, (settings, options) in enumerate([({"distance": "mean"}, ["--distance", "mean"]),
                                             ({"distance": "huber", "huber": 0.001}, ["--distance", "huber", "--huber", 0.001]),
                                             ({"trim": 0.2, "two_sided": True}, ["--trim", 0.2, "--two-sided"])]):
        said = json.loads(program("replay", folder / "lift", "--asset", towel, "--hold", "bending=5e-5", *options, "--json", "--quiet",
                                  "-o", tmp_path / str(k)))
        assert sysid.distances(lift, motion, **settings).score == said["score"]


def test_scores_are_robust_means_of_the_distances(lift, towel):
    motion = sysid.replay(lift, {"bending": 5e-5}, asset=towel)
    found = sysid.distances(lift, motion)
    assert [len(cloud) for cloud in found.clouds] == [len(cloud) for cloud in lift.clouds]
    trimmed = [np.sort(cloud)[:len(cloud) - int(0.05 * len(cloud))].mean() for cloud in found.clouds]
    assert found.scores == pytest.approx(trimmed, rel=1e-12) and found.score == pytest.approx(np.mean(trimmed), rel=1e-12)
    # By brute force, at a keyframe that is a step: no point is farther from the surface than from its nearest vertex.
    step = int(round((lift.times[4] - motion.times[0]) / 0.01))
    assert motion.times[step] == pytest.approx(lift.times[4] + found.time_offset)
    turn = np.array([[np.cos(found.yaw), -np.sin(found.yaw), 0], [np.sin(found.yaw), np.cos(found.yaw), 0], [0, 0, 1]])
    assert abs(found.yaw) < 1e-12  # the bounds leave none: the turn has no part in what follows
    seen = lift.clouds[4] @ turn - found.offset
    nearest = np.linalg.norm(seen[:, None] - motion.positions[step][None], axis=2).min(axis=1)
    assert (found.clouds[4] <= nearest + 1e-12).all() and found.clouds[4].mean() > 0.2 * found.clouds[0].mean()
    # Where nothing is fitted the camera's error stays.
    unmoved = sysid.distances(lift, motion, fit=False)
    assert (unmoved.offset == 0).all() and unmoved.score > found.score
    motion.positions += [0.01, -0.004, 0]  # the arrays are the caller's: moved by the camera's error
    assert sysid.distances(lift, motion, fit=False).score < unmoved.score


def test_a_tuned_asset_is_replayed_on_the_mesh_of_its_answer(folder, lift, tmp_path):
    tuned = folder / "tuned.json"
    said = json.loads(program("replay", folder / "lift", "--asset", tuned, "--json", "--quiet", "-o", tmp_path / "out"))
    for asset in (tuned, str(tuned), flash_sim.Asset(tuned)):
        motion = sysid.replay(lift, asset=asset)
        found = sysid.distances(lift, motion)
        assert found.score == said["score"] and found.weights.tolist() == [frame["weight"] for frame in said["frames"]]
    assert found.score == pytest.approx(flash_sim.sysid.answer(folder / "run").score, rel=1e-4)  # a last digit of the material
    assert motion.values["bending"] == flash_sim.Asset(tuned).values["bending_rigidity"]


def test_threads_replay_one_recording_and_other_threads_run_meanwhile(lift, towel):
    values = TRUTH * np.linspace(0.5, 2, 6)
    alone = [sysid.replay(lift, {"bending": value}, asset=towel) for value in values]
    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(lambda value: sysid.replay(lift, {"bending": value}, asset=towel, threads=1), values))
    assert all(np.array_equal(a.positions, b.positions) for a, b in zip(alone, together))
    assert len({motion.positions.tobytes() for motion in together}) == 6
    ticks, done = [], threading.Event()

    def tick():
        while not done.wait(0.001):
            ticks.append(None)
    thread = threading.Thread(target=tick)
    thread.start()
    sysid.replay(lift, mesh="sheet:0.2x0.2:0.01", asset=towel)
    done.set()
    thread.join()
    assert len(ticks) > 20  # of a replay that takes a second


def test_an_interrupt_ends_a_replay_within_a_step(folder):
    script = ("import flash_sim, sys; lift = flash_sim.sysid.load(sys.argv[1]); print('here', flush=True)\n"
              "try:\n    while True: flash_sim.sysid.replay(lift, asset=sys.argv[2], mesh='sheet:0.2x0.2:0.005')\n"
              "except KeyboardInterrupt:\n    print('interrupted', flash_sim.sysid.replay(lift, asset=sys.argv[2]).accepted)")
    running = subprocess.Popen([sys.executable, "-P", "-c", script, folder / "lift", folder / "towel.json"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    assert running.stdout.readline() == "here\n"
    time.sleep(1.5)
    running.send_signal(signal.SIGINT)
    said, errors = running.communicate(timeout=60)
    assert said == "interrupted True\n", errors


def test_steps_that_were_not_solved_are_told(lift, towel):
    with pytest.warns(sysid.SolverWarning, match="lift: not converged in .* % of the steps, residual up to"):
        motion = sysid.replay(lift, asset=towel, iterations=1, tolerance=1e-9)
    assert not motion.converged and motion.unconverged_share > 0 and motion.residual_max > 1e-9
    assert motion.accepted == (motion.unconverged_share <= 0.01 and motion.residual_max <= 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert sysid.replay(lift, asset=towel).unconverged_share == 0


def test_the_likelihood_finds_the_truth_and_leaves_the_rest_unlikely(lift, towel):
    def at(bending):
        return sysid.replay(lift, {"bending": bending}, asset=towel)
    likelihood = sysid.Likelihood(lift, at(1.02e-4), {"bending": (at(0.9e-4), at(1.1e-4))})
    values = TRUTH * np.array([0.5, 0.9, 0.97, 1, 1.03, 1.1, 2])
    logs = [likelihood.log(at(value)) for value in values]
    assert np.argmax(logs) in (2, 3, 4) and logs[0] < logs[1] - 2 and logs[-1] < logs[-2] - 2
    assert 2e-4 < likelihood.spreads[0] < 5e-3  # noise of 1 mm along the ray, and no less than a part of it
    several = sysid.Likelihood([lift, lift], [at(1.02e-4)] * 2, {"bending": ([at(0.9e-4)] * 2, [at(1.1e-4)] * 2)})
    twice = several.log([at(TRUTH)] * 2) - several.log([at(1.1e-4)] * 2)
    assert twice == pytest.approx(2 * (logs[3] - logs[5]), rel=1e-9)


def test_an_answer_is_what_its_folder_holds(folder):
    answer = sysid.answer(folder / "run")
    summary = json.loads((folder / "run" / "summary.json").read_text())
    assert sysid.answer(str(folder / "run" / "summary.json")).summary == answer.summary == summary
    assert answer.values == summary["best"]["parameters"] and answer.values["friction"] == 0.3
    assert answer.verdicts == {"bending": summary["parameters"]["bending"]["identifiable"]}
    assert answer.units["bending"] == "N m" and answer.units["young"] == "Pa" and answer.units["friction"] == "1"
    assert answer.held["friction"] == {"value": 0.3, "source": "measured"} and answer.usable
    assert answer.estimates["bending"] == summary["parameters"]["bending"]["estimate"]
    assert answer.intervals["bending"] == tuple(summary["parameters"]["bending"]["interval95"])
    assert answer.samples.dtype.names == ("bending", "areal_density", "weight") and answer.samples.shape == (64,)
    assert answer.samples["bending"].tolist() == [row[0] for row in summary["samples"]]
    assert answer.samples["areal_density"].tolist() == summary["sample_weights"]
    assert answer.samples["weight"].sum() == pytest.approx(1) and len(set(answer.samples["weight"])) == 1
    draws = flash_sim.Asset(folder / "tuned.json")  # which has the same draws
    assert sorted(draws.draws(64)["bending"]) == pytest.approx(sorted(answer.samples["bending"]), rel=1e-12)
    assert "bending: " in repr(answer)


def test_an_answer_that_was_edited_or_is_not_there_is_refused(folder, tmp_path):
    text = (folder / "run" / "summary.json").read_text()
    (tmp_path / "summary.json").write_text(text.replace('"exit_code": 0', '"exit_code": 3'))
    with pytest.raises(ValueError, match="summary.json: digest: .*one was edited"):
        sysid.answer(tmp_path)
    (tmp_path / "summary.json").write_text("[]")
    with pytest.raises(ValueError, match="summary.json"):
        sysid.answer(tmp_path)
    for missing in (tmp_path / "nowhere", folder / "lift"):
        with pytest.raises(ValueError, match="answer: folder: found no .*, expected the folder of a finished search"):
            sysid.answer(missing)
    for wrong in (None, 3, "a\0b"):
        with pytest.raises((ValueError, TypeError), match="^answer: folder: found"):
            sysid.answer(wrong)


NAN, INF = float("nan"), float("inf")
VALUES = [({"bendin": 1e-4}, 'bendin: unknown parameter .did you mean "bending"'), ({"bending": NAN}, "values: 'bending': found nan"),
          ({"bending": -1}, "^bending: found -1, expected 0 to 1e"), ({"friction": INF}, "values: 'friction': found inf"),
          ({"bending": "stiff"}, "values: 'bending': found 'stiff'"), ({"bending": [1e-4, 2e-4]}, "values: 'bending': found the shape"),
          ({"bending": None}, "values: 'bending': found None"), ({3: 1}, "values: found 3, expected a name"),
          ({"poisson": 0.7}, "^poisson: found 0.7, expected"), ({"density": 100}, "^density: found a sheet, expected a solid"),
          ({"grasp_depth": 0.01}, "^grasp_depth: acts on a grasp of the shape pinch"), ([1e-4], "values: found .*expected numbers by name"),
          ({"yield_curvature": 10}, "^yield_curvature: found bending_model plate"), ({"": 1}, "unknown parameter"), ("bending", "values: found"),
          ({"bending\0": 1}, "values: found .*null character"), ({"young": 0}, "^young: found 0"), ({"grasp_size": 0.5}, "0.5")]
SETTINGS = [({"mesh": "sheet:0.3x0.3:0.02"}, "size|large|side|0.3"), ({"mesh": "sheet:0.2x0.2"}, "^mesh"), ({"mesh": "nowhere.ply"}, "nowhere.ply"),
            ({"mesh": ""}, "replay: mesh: found ''"), ({"mesh": 3}, "replay: mesh: found 3"), ({"time_step": 0}, "time_step: found 0, expected above 0"),
            ({"time_step": NAN}, "time_step: found nan"), ({"time_step": 1e-12}, "time_step"), ({"time_step": "fast"}, "time_step: found 'fast'"),
            ({"iterations": 0}, "iterations: found 0, expected 1"), ({"iterations": 1.5}, "iterations: found 1.5"),
            ({"tolerance": 2}, "tolerance: found 2, expected 1e-12 to 1"), ({"tolerance": -1}, "tolerance: found -1"),
            ({"grasp_shape": "glue"}, "grasp_shape: found 'glue', expected one of"), ({"grasp_within": 0}, "grasp_within: found 0"),
            ({"grasp_within": 1.0}, "grasp_within"), ({"grasp_cell": -0.1}, "grasp_cell: found -0.1"), ({"clamp_slopes": 1}, "clamp_slopes: found 1, expected True"),
            ({"self_contact": 0}, "self_contact: found 0"), ({"self_contact": 1.0}, "self_contact"), ({"layer_friction": 0.1}, "layer_friction: found 0.1 without self_contact"),
            ({"device": "gpu"}, "^device"), ({"device": None}, "device: found None"), ({"device": "cuda:99"}, "^device"), ({"threads": -1}, "threads: found -1"),
            ({"threads": True}, "threads: found True"), ({"horizon": "no"}, "horizon: found 'no'"), ({"asset": "nowhere.json"}, "nowhere.json"),
            ({"asset": 3}, "replay: asset: found 3"), ({"asset": None}, "replay: asset: found none, and .*recording.json names none")]


def refused(call, *words, match, **named):
    with pytest.raises((ValueError, TypeError), match=match) as raised:
        call(*words, **named)
    text = str(raised.value)
    assert "\n" not in text and "--" not in text and "incompatible function arguments" not in text, text


def test_what_is_wrong_is_refused_by_name(lift, towel):
    for values, match in VALUES:
        refused(sysid.replay, lift, values, asset=towel, match=match)
    for settings, match in SETTINGS:
        refused(sysid.replay, lift, {}, **({"asset": towel} | settings), match=match)
    for other in (None, "lift", 3, {}):
        refused(sysid.replay, other, match="recording: found .*expected what load gives")
    assert sysid.replay(lift, asset=towel).accepted


def test_distances_of_what_is_no_motion_are_refused(lift, towel, folder, tmp_path):
    motion = sysid.replay(lift, asset=towel)
    for other in (None, motion.positions, "motion"):
        refused(sysid.distances, lift, other, match="distances: motion: found .*expected what replay gives")
    refused(sysid.distances, "lift", motion, match="distances: recording: found 'lift'")
    for settings, match in [({"distance": "median"}, "distance: found 'median', expected one of 'trimmed'"), ({"trim": 0.6}, "trim: found 0.6"),
                            ({"trim": NAN}, "trim: found nan"), ({"huber": 0}, "huber: found 0"), ({"fit": 1}, "fit: found 1"),
                            ({"two_sided": None}, "two_sided: found None")]:
        refused(sysid.distances, lift, motion, **settings, match=match)
    whole = motion.positions
    for positions, match in [(whole[:5], "motion.positions: found the shape"), (whole[:, :4], "motion.positions: found the shape"),
                             (whole[0], "motion.positions: found the shape"), (np.where(whole == whole.max(), NAN, whole), "motion.positions: found nan"),
                             (None, "motion.positions: found None"), ("x", "motion.positions: found 'x'")]:
        motion.positions = positions
        refused(sysid.distances, lift, motion, match=match)
    motion.positions = np.asarray(whole, np.float32)  # is converted
    assert sysid.distances(lift, motion).score == pytest.approx(0, abs=0.01)
    program("synth", "--asset", folder / "towel.json", "--mesh", MESH, "--duration", 1, "--rate", 4, "--resolution", "80x60", "--seed", 2, "--forces", "--quiet",
            "-o", tmp_path / "other")
    other = sysid.load(tmp_path / "other")
    assert np.isfinite(other.forces).all() and other.forces[-1, 2] > 0
    refused(sysid.distances, other, motion, match="distances: motion: found one of .*lift.*, expected one of .*other")
    for words, match in [((lift, motion, {}), "beside: found {}"), ((lift, motion, None), "beside: found None"),
                         ((lift, motion, {"bending": motion}), "beside: bending: found"), ((lift, [], {"bending": (motion, motion)}), "found 0 motions"),
                         (([], motion, {"bending": (motion, motion)}), "recordings: found none"),
                         ((lift, motion, {"bending": (motion, motion)}, -1), "repeatability: found -1"),
                         ((lift, motion, {"bending": (motion, None)}), "beside: bending: motion: found None")]:
        refused(sysid.Likelihood, *words, match=match)


def test_recordings_that_cannot_be_used_are_refused(folder, tmp_path):
    for path, match in [(tmp_path / "nowhere", "nowhere"), (None, "load: path: found None"), (3, "load: path: found 3"), ("a\0b", "load: path: found"),
                        (tmp_path, "recording.json"), (b"\xff\xfe", "load: path|recording")]:
        refused(sysid.load, path, match=match)
    good = json.loads((folder / "lift" / "recording.json").read_text())
    source = folder / "lift"

    def changed(**fields):
        file = json.loads(json.dumps(good))
        file["trajectories"] = {"gripper": str(source / "gripper.tum")}
        for keyframe in file["keyframes"]:
            keyframe["cloud"] = str(source / keyframe["cloud"])
        del file["camera"]
        (tmp_path / "recording.json").write_text(json.dumps(file | fields))
        return tmp_path
    assert sysid.load(changed()).name == "lift"
    (tmp_path / "empty.ply").write_text("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
    (tmp_path / "nan.ply").write_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\nnan 0 0\n")
    for fields, match in [({"keyframes": []}, "keyframes"), ({"keyframes": [{"t": 0, "cloud": "empty.ply"}]}, "empty|keyframes|points"),
                          ({"keyframes": [{"t": 0, "cloud": "nan.ply"}]}, "nan.ply|keyframes|empty"), ({"keyframes": [{"t": -1e9, "cloud": "empty.ply"}]}, "."),
                          ({"object": {"mesh": "sheet:-1x1:0.1"}}, "object.mesh"), ({"gravity": [0, 0]}, "gravity"), ({"schema": "x/1"}, "schema"),
                          ({"nuisance": {"offset_m": [-1, 0, 0]}}, "offset_m"), ({"grasps": [{"gripper": "hand"}]}, "grasps|gripper")]:
        refused(sysid.load, changed(**fields), match=match)
    (tmp_path / "recording.json").write_text("{")
    refused(sysid.load, tmp_path, match="recording.json")


def test_depth_pictures_are_read_and_tiff_is_named(folder, tmp_path):
    """The wheel has no reader of TIFF, whose library of Debian has a GPL part."""
    source = folder / "lift"
    (tmp_path / "a.tiff").write_bytes(b"II*\0")
    file = json.loads((source / "recording.json").read_text())
    file["trajectories"], file["camera"]["intrinsics"] = {"gripper": str(source / "gripper.tum")}, str(source / "camera_info.yaml")
    size = [int(line.split(":")[1]) for line in (source / "camera_info.yaml").read_text().splitlines()
            if line.startswith(("image_height:", "image_width:"))]
    height, width = min(size), max(size)
    np.save(tmp_path / "a.npy", np.full((height, width), 0.5))
    for name in ("a.npy", "a.tiff"):
        file["keyframes"] = [{"t": 0.5, "depth": name}]
        (tmp_path / "recording.json").write_text(json.dumps(file))
        if name == "a.npy":
            assert sysid.load(tmp_path).clouds[0].shape == (width * height, 3)
        else:
            refused(sysid.load, tmp_path, match="a.tiff: is named as a TIFF, which this build does not read")


def test_parameters_have_units_and_ranges():
    known = sysid.parameters()
    assert known["bending"]["unit"] == "N m" and known["friction"]["unit"] == "1" and known["bending"]["low"] == 0
    assert {"young", "poisson", "areal_density", "start_yaw", "grasp_size"} <= set(known)


def test_programs_are_commands(tmp_path):
    for name in ("flash-sim", "flash-sysid"):
        done = subprocess.run([BIN / name, "--version"], capture_output=True, text=True)
        assert done.returncode == 0 and flash_sim.__version__ in done.stdout
        assert subprocess.run([BIN / name, "nothing"], capture_output=True).returncode == 2
    done = subprocess.run([BIN / "flash-sysid", "segment", "raw", "-o", tmp_path / "out"], capture_output=True, text=True)
    assert done.returncode == 2 and "it needs PCL" in done.stderr and done.stderr.count("\n") == 1


def test_the_wheel_links_no_gpl_library():
    """What the extension and the programs load, by name, all the way down."""
    package = pathlib.Path(flash_sim.__file__).parent
    found = [*package.glob("_core*.so"), *(package / "bin").iterdir()]
    assert len(found) == 3
    free = {"linux-vdso", "ld-linux-x86-64", "libc", "libm", "libgcc_s", "libstdc++", "libyaml-cpp", "libpng16", "libz", "libdl", "libpthread", "librt"}
    for path in found:
        linked = subprocess.run(["ldd", path], capture_output=True, text=True, check=True).stdout.split("\n")
        names = {os.path.basename(line.split()[0]).split(".so")[0] for line in linked if line.strip()}
        assert names <= free, (path, names - free)
