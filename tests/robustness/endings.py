#!/usr/bin/env python3
"""How the programs end: a result that standard output does not take, signals, jobs that cannot end or fit, paths that the
file system refuses, and values out of range. Each in one line, with the exit code that README.md states, and nothing
left behind by what was refused."""
import argparse
import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time

import program

FAILED, REFUSED = 1, 2


def scene(cell, **fields):
    return {"schema": "flash-scene/1", "timestep": 0.01, "gravity": [0, 0, -9.81],
            "objects": {"cloth": f"cloth_{cell}.json"}} | fields


def write_inputs(folder):
    for cell in (0.05, 0.004):
        (folder / f"cloth_{cell}.json").write_text(json.dumps(program.ASSET | {"mesh": f"sheet:0.2x0.2:{cell}:alternating"}))
    far = {"hand": {"keyframes": [{"t": 0, "translation": [0, 0, 1]}], "grasps": [{"from": 0}]}}
    curved = folder / "curved.obj"
    curved.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 2 4 3\n")
    (folder / "cloth_curved.json").write_text(json.dumps(program.ASSET | {"mesh": "curved.obj"}))
    for name, content in (("short", scene(0.05, steps=2)), ("default", scene(0.05)), ("long", scene(0.004, steps=100000)),
                          ("nothing_grasped", scene(0.05, end_effectors=far)), ("curved", scene("curved", steps=2)),
                          ("before_start", scene(0.05, keyframes=[-1])), ("too_many", scene(0.05, steps=2 ** 32)),
                          ("too_long", scene(0.05, duration=1e9)), ("two_lengths", scene(0.05, steps=2, duration=0.02))):
        (folder / f"{name}.json").write_text(json.dumps(content))
    (folder / "too_short_steps.json").write_text(json.dumps(scene(0.05) | {"timestep": 1e-300}))
    (folder / "twice.json").write_text('{"schema": "flash-scene/1", "timestep": 0.01, "timestep": 0.02}')
    (folder / "loop").symlink_to("loop")
    write_calibrations(folder)


def write_calibrations(folder):
    """Two arms on one camera, the second with an answer that cannot be used; a camera folder with such an answer."""
    still = {"translation": [0, 0, 1], "rotation_xyzw": [1, 0, 0, 0]}
    usable = {"schema": "flash-extrinsics/1", "setup": "eye-to-hand", "method": "errors_in_variables",
              "transform": still | {"parent": "base", "child": "camera"},
              "target_pose": still | {"parent": "gripper", "child": "target"},
              "covariance": [[1e-6 if i == j else 0 for j in range(6)] for i in range(6)],
              "warnings": ["two views were left out"], "exit_code": 0}
    unusable = usable | {"warnings": ["rotations turn about one axis only"], "exit_code": 3}
    (folder / "left.json").write_text(json.dumps(usable))
    (folder / "right.json").write_text(json.dumps(unusable))
    (folder / "raw").mkdir()
    (folder / "raw" / "0.ply").write_text("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n"
                                          "property float y\nproperty float z\nend_header\n")
    (folder / "raw" / "extrinsics.json").write_text(json.dumps(unusable))


def refusals(sim, sysid, calib):
    """Command line, words of the one line on stderr."""
    run, bench, synth = [sim, "run"], [sim, "bench"], [sysid, "synth", "--asset", "cloth_0.05.json", "-o", "out"]
    grid = [sysid, "grid", "recording", "--asset", "asset.json", "-o", "out"]
    long = "x" * 300
    return [
        ([*run, "nothing_grasped.json", "-o", "out"], ["end effector hand", "the nearest is 0.99 m away"]),
        ([*run, "curved.json", "-o", "out"], ["flat"]),
        ([*run, "before_start.json", "-o", "out"], ["before_start.json", "keyframes", "times from 0"]),
        ([*run, "too_many.json", "-o", "out"], ["steps", "found 4294967296", "0 to 1,000,000"]),
        ([*run, "two_lengths.json", "-o", "out"], ["two_lengths.json", "steps", "found duration beside it"]),
        ([sim, "run", "short.json", "--config", "c.toml", "-o", "out"], ["--config", "before", "flash-sim --config FILE run"]),
        ([*grid, "--bending", "1e-4,2e-4", "--config", "c.toml"], ["--config", "before", "flash-sysid --config FILE grid"]),
        ([*grid, "--bending", "1e-4,2e-4", "--rollouts", "short.json"], ["--rollouts: short.json", "expected a folder"]),
        ([*grid, "--bending", "1e-4,2e-4", "--rollouts", long], ["--rollouts: " + long, "too long", "expected a folder"]),
        ([*grid, "--bending", "1e-4,2e-4", "--map", "bending,bending"], ["--map", "found bending twice"]),
        ([*grid, "--bending", "1e-4,2e-4", "--map", "bending,young"], ["--map", "found young", "searched"]),
        ([*grid, "--bending", "1e-4,2e-4", "--resume", "--force"], ["--resume", "--force"]),
        ([*run, "too_long.json", "-o", "out"], ["duration", "at most 1,000,000 steps"]),
        ([*run, "twice.json", "-o", "out"], ["timestep", "given twice"]),
        ([*run, "too_short_steps.json", "-o", "out"], ["timestep: found 1e-300, expected a number from 1e-07 to 1"]),
        *[([*words, "--time-step", "1e-300"], ["--time-step", 'found "1e-300"', "from 1e-07 to 1"])
          for words in (bench, synth, [*grid, "--bending", "1e-5,1e-4"])],
        ([*run, "short.json", "--steps", "4294967296", "-o", "out"], ["--steps", "from 0 to 1,000,000"]),
        ([*run, "short.json", "--steps", "-1", "-o", "out"], ["--steps", "found \"-1\"", "from 0 to 1,000,000"]),
        ([*run, "short.json", "--duration", "1e9", "-o", "out"], ["--duration", "1,000,000 steps"]),
        ([*run, "short.json", "-o", ""], ["--out", "found \"\""]),
        ([*run, "loop", "-o", "out"], ["loop: cannot be read: Too many levels of symbolic links"]),
        ([*run, "short.json", "-o", "loop/out"], ["loop/out", "Too many levels of symbolic links"]),
        ([*run, "short.json", "-o", long], [long, "File name too long"]),
        ([*run, "short.json", "-o", "short.json/out"], ["short.json/out", "Not a directory"]),
        ([sim, "rum"], ["unknown verb", "run"]),
        ([*grid, "--bendin", "1e-4"], ["--bendin: unknown option", 'did you mean "--bending"']),
        *[([*words, old, "1"], [f"{old}: unknown option", f'did you mean "{new}"']) for words, old, new in (
            (grid, "--fix", "--hold"), (synth, "--set", "--hold"), ([sysid, "fit", "recording"], "--freeze", "--hold"),
            (synth, "--offset", "--offset-error"),
            (synth, "--time-offset", "--time-offset-error"),
            *[([sysid, "import", "recording"], *names) for names in (
                ("--within", "--grasp-within"), ("--shape", "--grasp-shape"), ("--offset", "--offset-bound"),
                ("--yaw", "--yaw-bound"), ("--clock", "--time-offset-bound"), ("--start-yaw", "--start-yaw-bound"),
                ("--table-error", "--table-height-bound"), ("--table-height", "--table-z"), ("--sheet", "--mesh"),
                ("--cell", "--mesh"))],
            *[([sysid, "segment", "raw"], *names) for names in (
                ("--rate", "--times"), ("--crop-min", "--crop-x"), ("--table-height", "--table-z"))],
            ([sim, "run", "short.json"], "--durations", "--duration"), (bench, "--vertice", "--vertices"))],
        ([*grid, "--friction", "0.3"], ["--friction: found one value", "--hold friction=0.3"]),
        ([*grid, "--bending", "1e-5,1e-4", "--hold", "friction=0.3:weighed"], ["--hold friction", "0.3:weighed", ":measured"]),
        ([*synth, "--displacement", "0 0 0.1"], ["--displacement", "x,y,z"]),
        ([*grid, "--bending", "1e-4,1e-4"], ["--bending", "twice"]),
        ([*bench, "--vertices", "1e9"], ["--vertices", "from 4 to 1,000,000"]),
        *[([*bench, "--vertices", sizes, "--threads", "1000", "--envs", "1000"], ["--vertices", "MB of memory"])
          for sizes in ("1000000", "4,1000000")],
        *[([*words, option, text], [option, f'found "{text}"', "on either side of each comma"]) for words, option, texts in (
            (bench, "--vertices", ("1000,", ",1000", "1000,,2000", ",")), (bench, "--envs", ("4,", ",,4")),
            (grid, "--map", ("bending,,friction",)), ([sysid, "report", "run"], "--map", ("bending,",)),
            (grid, "--share", ("offset,",)), ([sysid, "replay", "recording", "-o", "out"], "--frames", ("1,", ",2")),
            ([sysid, "import", "--markers", "tracks.csv"], "--on-support", ("A,",))) for text in texts],
        ([*bench, "--vertices", "1000,x"], ["--vertices", 'found "x"', "from 4 to 1,000,000"]),
        ([*grid, "--map", "bending"], ["--map: found 1, expected 2"]),
        ([*grid, "--share", "offset,roll"], ["--share: roll not in {offset,yaw,time-offset}"]),
        ([*grid, "--bending", "1e-4,,2e-4"], ["--bending", '"" is not a number']),
        ([sysid, "import", "raw", "--trajectory", "none", "--mesh", "sheet:0.2x0.2:0.05:alternating", "--grasp", "vertices:1,", "-o", "out"],
         ["--grasp", "vertices:1,", "whole numbers"]),
        ([*bench, "--time-step", "nan"], ["--time-step", "found \"nan\"", "from 1e-07 to 1"]),
        ([*bench, "--young-min", "5", "--young-max", "3"], ["--young-max", "found 3", "at least the 5"]),
        ([*synth, "--hold", "foo=1"], ["--hold foo", "unknown parameter"]),
        ([*synth, "--hold", "friction=0.3", "--hold", "friction=0.4"], ["--hold friction", "given twice"]),
        ([*synth, "--hold", "friction=1e300"], ["--hold friction", "0 to 10"]),
        ([*grid, "--envs", "-1"], ["--envs", "found \"-1\"", "from 1 to 100,000"]),
        ([*grid, "--bending", "1e-5:1e-3:3000000"], ["--bending", "3000000", "from 1 to 1,000,000"]),
        ([*grid, "--table-height", "9:10:2"], ["--table-height", "-0.5 to 0.5"]),
        ([*grid, "--start-yaw", "a"], ["--start-yaw", "\"a\" is not a number"]),
        ([*grid, "--bending", "1e-4,2e-4", "--hold", "foo=1"], ["--hold foo", "unknown parameter"]),
        ([*grid, "--bending", "1e-5:1e-3:3", "--grasp-depth", "0.01:0.03:2"], ["--grasp-depth", "pinch"]),
        *[([*words, "--from", "3"], ["--from, --until", "no keyframe between", "0 to 0.6 s"]) for words in (
            [*grid, "--bending", "1e-4,2e-4"], [sysid, "replay", "recording", "--asset", "asset.json", "-o", "out"])],
        *([] if calib is None else [
            *[([calib, verb, ".", "--depth-scale", scale, "--target", "chessboard:9x6:0.025"],
               ["--depth-scale", f'found "{scale}"', "from 1e-09 to 10"])
              for verb in ("detect", "handeye", "plan") for scale in ("nan", "1e300", "0")],
            ([calib, "register", "left.json", "right.json", "--without-images"], ["right.json", "exit_code", "one axis"]),
            ([calib, "validate", ".", "--extrinsics", "right.json"], ["right.json", "exit_code", "one axis", "--despite-doubts"]),
            ([calib, "handeye", ".", "--setups", "eye-in-hand"], ["--setups: unknown option", 'did you mean "--setup"']),
            ([calib, "register", "left.json", "--workspace", "0.5", "0", "0.3"], ["--workspace", 'found "0.5"', "x,y,z"]),
            ([calib, "detect", ".", "--target", ""], ["--target", "found \"\""])]),
        ([sysid, "segment", "raw", "-o", "out"], ["extrinsics.json", "exit_code", "one axis", "--despite-doubts"])]


def check_accepted(options, folder):
    """--despite-doubts takes a calibration that cannot be used; its warnings go on."""
    if options.calib is None:
        return
    done = program.call(options.calib, "register", folder / "left.json", folder / "right.json", "--without-images",
                        "--despite-doubts", "-o", folder / "cell.json")
    yield done.returncode == 3, f"exit code {done.returncode}, expected 3: the cell stands on what cannot be used"
    cell = json.loads((folder / "cell.json").read_text())
    for warning in ("left.json: two views were left out", "right.json: rotations turn about one axis only"):
        yield warning in done.stderr and any(warning in text for text in cell["notices"]), f"{warning}: {done.stderr}"
    yield cell["exit_code"] == 3, "the next reader would take it for usable"


def left_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def check_refusals(options, folder):
    before = left_in(folder)
    for words, expected in refusals(options.sim, options.sysid, options.calib):
        done = program.call(*words, "--quiet" if "bench" not in words and "rum" not in words else "--json", cwd=folder)
        text = done.stderr.rstrip("\n")
        where = " ".join(map(str, words[1:]))[:120]
        yield done.returncode == REFUSED, f"{where}: exit code {done.returncode}: {text[-500:]}"
        yield text and "\n" not in text and len(text) < 900, f"{where}: not one readable line: {text[:900]}"
        yield all(word in text for word in expected), f"{where}: does not say {expected}: {text[:500]}"
        yield not done.stdout, f"{where}: prints {done.stdout[:200]}"
        yield not any(word.startswith("--") and "_" in word for word in text.split()), f"{where}: no such option: {text}"
        yield left_in(folder) == before, f"{where}: left {set(left_in(folder)) - set(before)}"


def check_lost_results(options, folder):
    run = [options.sim, "run", "short.json"]
    commands = [[*run, "--force", "-o", "lost"], [options.sim, "--help"], [options.sysid, "--version"],
                [options.sysid, "synth", "--asset", "cloth_0.05.json", "--kind", "hang", "--duration", "0.1", "--json",
                 "--force", "-o", "lost_recording"]]
    if options.calib:
        commands.append([options.calib, "--help"])
    for words in commands:
        for stdout, name in ((open("/dev/full", "w"), "full"), (None, "closed")):
            closed = {"preexec_fn": lambda: os.close(1)} if stdout is None else {"stdout": stdout}
            done = subprocess.run(list(map(str, words)), cwd=folder, stderr=subprocess.PIPE, text=True, **closed)
            lines = [line for line in done.stderr.splitlines() if "standard output" in line]
            yield done.returncode == FAILED, f"{words[1:]}, stdout {name}: exit code {done.returncode}"
            yield len(lines) == 1, f"{words[1:]}, stdout {name}: {done.stderr}"
    quiet = subprocess.run([str(options.sim), "run", "short.json", "--quiet", "-o", "quiet"], cwd=folder,
                           preexec_fn=lambda: os.close(1))
    yield quiet.returncode == 0, f"--quiet has no result to lose: exit code {quiet.returncode}"


def started(words, folder, number):
    """The program, once it answers to the signal."""
    process = subprocess.Popen(list(map(str, words)), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    status = pathlib.Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        caught = [line for line in status.read_text().splitlines() if line.startswith("SigCgt")]
        if caught and int(caught[0].split()[1], 16) >> (number - 1) & 1:
            break
        time.sleep(0.01)
    time.sleep(0.3)  # past the command line, which catches signals too
    return process


def check_signals(options, folder):
    for number in (signal.SIGINT, signal.SIGTERM):
        out = folder / f"stopped_{number}"
        process = started([options.sim, "run", "long.json", "--quiet", "-o", out], folder, number)
        while process.poll() is None and not (out / "frames" / "000001.ply").exists():
            time.sleep(0.01)
        process.send_signal(number)
        text = process.communicate()[1]
        rows = len((out / "log.csv").read_text().splitlines()) - 1
        frames = len(list((out / "frames").iterdir()))
        yield process.returncode == FAILED, f"{number}: exit code {process.returncode}"
        yield "stopping after this step" in text, f"{number}: does not answer: {text}"
        yield f"stopped after {rows:,} of 100,000 steps" in text, f"{number}: does not say what was done: {text}"
        yield f"{frames:,} frames" in text and str(out) in text and "--force" in text, f"{number}: nor what is left: {text}"
        yield frames == rows + 1, f"{number}: {frames} frames of {rows} steps"
    process = started([options.sim, "bench", "--vertices", "2000", "--steps", "100000", "--envs", "1"], folder, signal.SIGINT)
    process.send_signal(signal.SIGINT)
    text = process.communicate()[1]
    yield process.returncode == FAILED and "stopped" in text, f"bench: exit code {process.returncode}: {text}"
    process = started([options.sim, "bench", "--vertices", "20000", "--steps", "100000", "--envs", "1"], folder,
                      signal.SIGTERM)
    process.send_signal(signal.SIGTERM)
    process.stderr.readline(), process.stderr.readline()  # the answer to the first
    process.send_signal(signal.SIGTERM)
    process.communicate()
    yield process.returncode == 128 + signal.SIGTERM, f"a second signal: exit code {process.returncode}"


def check_two_runs(options, folder):
    """Into the folder of a run that is going on no other run writes, whenever it starts."""
    out = folder / "shared"
    first = started([options.sim, "run", "long.json", "--quiet", "-o", out], folder, signal.SIGTERM)
    while first.poll() is None and not (out / "frames" / "000002.ply").exists():
        time.sleep(0.01)
    second = program.call(options.sim, "run", folder / "short.json", "--quiet", "--force", "-o", out)
    yield second.returncode == REFUSED, f"--force beside a run: exit code {second.returncode}: {second.stderr}"
    yield (second.stderr == f"flash-sim: {out}: another run is writing to it; wait for it, or name another folder\n",
           f"--force beside a run: {second.stderr}")
    first.send_signal(signal.SIGTERM)
    text = first.communicate()[1]
    rows = len((out / "log.csv").read_text().splitlines()) - 1
    frames = sorted(path.name for path in (out / "frames").iterdir())
    yield f"stopped after {rows:,} of 100,000 steps" in text, f"the run beside --force: {text}"
    yield frames == [f"{k:06d}.ply" for k in range(rows + 1)], f"frames of the run beside --force: {frames}"
    both = folder / "at_once"
    words = list(map(str, [options.sim, "run", "long.json", "--steps", "20", "--quiet", "-o", both]))
    runs = [subprocess.Popen(words, cwd=folder, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [run.communicate()[1] for run in runs]
    codes = sorted(run.returncode for run in runs)
    yield codes == [0, REFUSED], f"two runs at once: exit codes {codes}: {said}"
    yield sum(text.count("another run is writing") for text in said) == 1, f"two runs at once: {said}"
    yield len(list((both / "frames").iterdir())) == 21, "two runs at once: frames"


def check_defaults(options, folder):
    done = program.must(options.sim, "run", folder / "default.json", "-o", folder / "by_default")
    yield "100 steps are run, the default" in done.stderr, f"the default is not said: {done.stderr}"
    times = [line.split(",")[1] for line in (folder / "by_default" / "log.csv").read_text().splitlines()[1:]]
    yield times == [f"{(k + 1) / 100:g}" for k in range(100)], f"times of log.csv: {times}"
    done = program.must(options.sim, "run", folder / "default.json", "--duration", "0.05", "-o", folder / "by_duration")
    yield "default" not in done.stderr and "5 steps in" in done.stdout, f"--duration: {done.stderr}{done.stdout}"
    done = program.must(options.sim, "run", "--help")
    yield "Up to 1 % of the steps" in done.stdout, "--help does not say what is tolerated"


def check_resume(options, folder):
    """A folder without a search is said to be one; of what was changed, a setting is named before what follows from it."""
    grid = [options.sysid, "grid", folder / "recording", "--asset", folder / "asset.json", "--bending", "1e-4,2e-4",
            "--no-solver-check", "--no-horizon", "--resume", "-o", folder / "begun"]
    done = program.call(*grid)
    yield done.returncode in (0, 3) and done.stderr.count("holds no search yet") == 1, f"--resume of nothing: {done.stderr}"
    done = program.call(*grid)
    yield done.returncode in (0, 3) and "holds no search" not in done.stderr, f"--resume: {done.stderr}"
    done = program.call(*grid, "--time-step", "0.005")
    yield (done.returncode == REFUSED and "results: time_step_s was 0.01 and is 0.005" in done.stderr,
           f"--resume --time-step: exit code {done.returncode}: {done.stderr}")
    done = program.call(*grid, "--posterior", "sampling")
    yield (done.returncode == REFUSED and "results: posterior (--posterior) was absent and is sampling" in done.stderr,
           f"--resume --posterior: exit code {done.returncode}: {done.stderr}")
    # No permission keeps an administrator out; a folder in the place of the lock does, as a read-only disk would.
    (folder / "begun" / ".lock").unlink()
    (folder / "begun" / ".lock").mkdir()
    for words in (grid, [*(word for word in grid if word != "--resume"), "--force"]):
        before = left_in(folder / "begun")
        done = program.call(*words)
        yield (done.returncode == REFUSED and done.stderr == f"flash-sysid: {folder / 'begun'}: Is a directory\n",
               f"a search that cannot be locked: exit code {done.returncode}: {done.stderr}")
        yield left_in(folder / "begun") == before, "a search that cannot be locked loses something"


def check_order(options, folder):
    """A search goes on in the order of its recordings, in whatever order they are named: to the same files."""
    second = folder / "second"
    program.must(options.sysid, "synth", "--asset", folder / "asset.json", "--mesh", "sheet:0.2x0.2:0.05:alternating", "--duration",
                 "0.6", "--seed", "2", "--noise", "0.003", "--quiet", "-o", second)
    words = ["--asset", folder / "asset.json", "--bending", "1e-5,1e-4,2e-4", "--envs", "1", "--no-solver-check",
             "--no-horizon", "--quiet"]
    tables = ("results.csv", "registrations.csv", "keyframes.csv", "grid.json")
    run = folder / "ordered"
    done = program.call(options.sysid, "grid", folder / "recording", second, *words, "-o", run)
    yield done.returncode in (0, 3), f"grid of two: {done.stderr}"
    alone = {name: (run / name).read_bytes() for name in tables}
    lines = alone["results.csv"].splitlines(keepends=True)
    (run / "results.csv").write_bytes(b"".join(lines[:2]))  # of three candidates
    done = program.call(options.sysid, "grid", second, folder / "recording", *words, "--resume", "-o", run)
    yield done.returncode in (0, 3), f"--resume in another order: {done.stderr}"
    for name in tables:
        yield (run / name).read_bytes() == alone[name], f"--resume in another order: {name} differs"
    for more in ([], ["--resume"]):
        (run / "grid.json").unlink(missing_ok=True)
        before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
        done = program.call(options.sysid, "grid", folder / "recording", second, *words, *more, "-o", run)
        yield done.returncode == REFUSED and done.stderr.count("\n") == 1, f"without grid.json {more}: {done.stderr}"
        yield "found results.csv without the grid.json" in done.stderr, f"without grid.json {more}: {done.stderr}"
        after = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
        yield after == before, f"without grid.json {more}: the folder has changed"


def check_file_limit(options, folder):
    """A file that may not grow is told as a full disk is: one line, and no signal."""
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024))
    grid = ["--bending", "1e-4,2e-4", "--no-solver-check", "--no-horizon"]
    inputs = [folder / "recording", "--asset", folder / "asset.json"]
    for words in ([options.sim, "run", folder / "default.json", "--steps", "20"],
                  [options.sysid, "synth", "--asset", folder / "asset.json", "--duration", "0.2"],
                  [options.sysid, "replay", *inputs], [options.sysid, "grid", *inputs, *grid]):
        done = program.call(*words, "--quiet", "-o", folder / f"limited_{words[1]}", preexec_fn=limit)
        yield done.returncode == FAILED, f"{words[1]}, files of 1 KB: exit code {done.returncode}: {done.stderr}"
        yield ("File too large" in done.stderr and done.stderr.count("\n") == 1,
               f"{words[1]}, files of 1 KB: {done.stderr}")


def check_collapse(options, folder):
    """A solid at a point, where its law leaves it, ends with 3 by name; and a run in motion is not said to be at rest."""
    corners = [[0.02 * x, 0.02 * y, 0.02 * z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    props = {"constitutive": "TET_NEOHOOKEAN", "density": 300, "young": 3e4, "poisson": 0}
    (folder / "block_asset.json").write_text(json.dumps(
        {"schema": "flash-asset/1", "mesh": "box:0.02x0.02x0.02:0.02", "element_type": "TETRAHEDRON", "mechanical_props": props}))
    for name, share, code in (("whole", 1, 0), ("point", 0.05, 3)):
        (folder / f"{name}.obj").write_text("".join("v %g %g %g\n" % tuple(share * a for a in v) for v in corners) + "f 1 2 3\n")
        (folder / f"{name}.json").write_text(json.dumps(
            {"schema": "flash-scene/1", "timestep": 0.01, "steps": 20, "gravity": [0, 0, 0],
             "objects": {"block": {"asset": "block_asset.json", "start": {"mesh": f"{name}.obj"}}}}))
        done = program.call(options.sim, "run", folder / f"{name}.json", "--json", "-o", folder / name)
        yield done.returncode == code, f"a block, {name}: exit code {done.returncode}: {done.stderr}"
        summary = json.loads(done.stdout)
        yield summary["at_rest"] is None, f"at_rest of a run in motion: {summary['at_rest']}"
        named = [text for text in (done.stderr, *summary["warnings"]) if "block: 5 of 5 tetrahedra have less than" in text]
        yield len(named) == (2 if code else 0), f"a block, {name}: {done.stderr} {summary['warnings']}"
        yield summary["collapsed_elements"] == (5 if code else 0), f"a block, {name}: {summary['collapsed_elements']}"


def check_fixed(options, folder):
    """What is said to be understood is what is simulated: a constant of the command line, not the asset's."""
    words = ["--asset", folder / "asset.json", "--hold", "areal_density=0.25:measured", "-o", folder / "fixed", "--force"]
    for verb in (["replay"], ["grid", "--bending", "1e-4,2e-4", "--no-solver-check", "--no-horizon"]):
        done = program.call(options.sysid, *verb, folder / "recording", *words)
        said = [line for line in done.stderr.splitlines() if "kg/m^2" in line]
        yield (len(said) == 1 and said[0].endswith(", 0.25 kg/m^2") and "--hold areal_density=0.25" in said[0],
               f"{verb[0]} --hold: {done.stderr}")


def check_killed_replay(options, folder):
    """What a replay that was killed leaves beside its pictures is gone after the next, and pictures of other frames."""
    replay = [options.sysid, "replay", folder / "recording", "--asset", folder / "asset.json", "--quiet", "-o", folder / "replayed"]
    program.must(*replay)
    (folder / "replayed" / "002.png.12345-6.tmp").write_bytes(b"half")
    for name in ("099.png", "099_mesh.ply", "notes.txt"):
        (folder / "replayed" / name).write_bytes(b"old")
    program.must(*replay, "--force")
    for name, stays in (("099.png", False), ("099_mesh.ply", False), ("notes.txt", True), ("overlay.csv", True)):
        yield (folder / "replayed" / name).exists() == stays, f"replay --force, {name}: there is {not stays}"
    left = [path.name for path in (folder / "replayed").iterdir() if path.suffix == ".tmp"]
    yield not left, f"replay --force keeps {left}"


def check_seams(options, folder):
    """A sheet of two halves that are not joined is warned of, and the warning is no matter of --quiet."""
    grid = [(0.05 * i, 0.05 * j) for j in (0, 1, 2, 2, 3, 4) for i in range(5)]  # the third row twice
    corners = [(5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5) for j in (0, 1, 3, 4) for i in range(4)]
    (folder / "seam.obj").write_text("".join("v %g %g 0\n" % place for place in grid) +
                                     "".join("f %d %d %d %d\n" % tuple(v + 1 for v in face) for face in corners))
    done = program.call(options.sysid, "replay", folder / "recording", "--asset", folder / "asset.json", "--mesh",
                        folder / "seam.obj", "--quiet", "-o", folder / "seam")
    yield ("seam.obj: 10 of its 30 vertices share a place with another and are not joined: the mesh falls into 2 parts"
           in done.stderr and done.stderr.startswith("flash-sysid: warning: ")), f"replay of a seam: {done.stderr}"


def check_fit(options, folder):
    """The guide's own line after the guide's own grid: a frozen parameter need not have been searched."""
    recording, asset, run = folder / "held", folder / "asset.json", folder / "run"
    mesh = ["--mesh", "sheet:0.2x0.2:0.025:alternating"]  # that of the recording has half its cells
    program.must(options.sysid, "synth", "--asset", asset, "--mesh", "sheet:0.2x0.2:0.0125:alternating", "--duration", "0.6", "--seed", "1",
                 "--quiet", "-o", recording)
    program.must(options.sysid, "grid", recording, "--asset", asset, "--bending", "1e-5:1e-3:9:log", *mesh,
                 "--no-solver-check", "--no-horizon", "--no-plan", "--quiet", "-o", run)
    line = [options.sysid, "fit", recording, "--start", run, "--no-solver-check", "--no-horizon", "--no-plan", "--quiet"]
    done = program.call(*line, "--hold", "poisson", "-o", folder / "fitted")
    told = [words for words in done.stdout.splitlines() if words.startswith("bending")]
    yield done.returncode == 0 and len(told) == 1, f"fit: exit code {done.returncode}: {done.stderr}{done.stdout}"
    yield told and "(95 %: " in told[0], f"fit: prints no interval: {done.stdout}"
    yield "not those of the search" not in done.stderr and "the search had" not in done.stderr, f"fit: {done.stderr}"
    fit = json.loads((folder / "fitted" / "summary.json").read_text())
    yield fit["fixed"]["poisson"]["value"] == 0.3, f"fit: held at {fit['fixed']}"
    yield mesh[1] in fit["settings"]["mesh"], f"fit: on the mesh {fit['settings']['mesh']}, not that of the search"
    program.must(options.sysid, "report", folder / "fitted", "--quiet", "-o", folder / "fitted.html")
    done = program.call(*line, "--from", "0.2", "--time-step", "0.02", "-o", folder / "later")
    yield ("recording held keyframes: not those of the search" in done.stderr and
           "time_step_s: found 0.02, the search had 0.01" in done.stderr, f"fit --from: {done.stderr}")
    done = program.call(*line, "--hold", "poisson", "--distance", "huber", "--huber", "1e-4", "-o", folder / "huber")
    yield done.returncode in (0, 3), f"fit --distance huber: exit code {done.returncode}: {done.stderr}"
    huber = json.loads((folder / "huber" / "summary.json").read_text())
    yield huber["best"]["score"] != fit["best"]["score"], f"fit --distance huber: scores as without, {fit['best']['score']}"
    done = program.call(*line, "--hold", "poison", "-o", folder / "other")
    yield done.returncode == REFUSED and 'did you mean "poisson"' in done.stderr, f"fit --hold poison: {done.stderr}"


def check_kept_motions(options, folder):
    """A search whose motions can be kept no longer is named with its option before anything is simulated."""
    recording, asset, run = folder / "held", folder / "asset.json", folder / "run"  # of check_fit
    # No permission keeps an administrator out; a file in the place of the folder does, as a read-only disk would.
    (run / "motions").rename(run / "moved")
    (run / "motions").write_text("")
    refused = f"{run / 'motions'}: cannot be written: Not a directory, expected a folder that takes files\n"
    for words, option in ((["fit", recording, "--start", run], "--start"),
                          (["plan", recording, "--asset", asset, "--run", run], "--run"), (["predict", run, recording], "run")):
        done = program.call(options.sysid, *words, "--quiet", "-o", folder / f"kept_{words[0]}")
        yield (done.returncode == REFUSED and done.stderr.endswith(f"flash-sysid: {option}: {refused}"),
               f"{words[0]} of a search that keeps no motions: exit code {done.returncode}: {done.stderr}")
        yield not (folder / f"kept_{words[0]}").exists(), f"{words[0]}: something is left of what was refused"
    (run / "motions").unlink()
    (run / "moved").rename(run / "motions")


def check_tuned(options, folder):
    """A tuned asset has the score that a replay with the search's options gives. Of other options it is said that they are
    others. What cannot be used is reported all the same, and exported with the exit code of the search."""
    recording, asset, run = folder / "held", folder / "asset.json", folder / "run"  # of check_fit
    tuned = folder / "tuned.json"
    program.must(options.sysid, "export", run, "--asset", asset, "--quiet", "-o", tuned)
    score = json.loads(tuned.read_text())["identification"]["score_m"]
    replay = [options.sysid, "replay", recording, "--asset", tuned, "--json", "--force", "-o", folder / "of_tuned"]
    for mesh in ([], ["--mesh", "sheet:0.2x0.2:0.025:alternating"]):  # of the search, whether it is given or not
        done = program.must(*replay, *mesh)
        found = json.loads(done.stdout)["score"]
        yield abs(found - score) <= 1e-9, f"replay of the tuned asset {mesh}: score {found}, the asset has {score}"
        yield "the search behind the asset had" not in done.stderr, f"replay as searched {mesh}: {done.stderr}"
    done = program.must(*replay, "--mesh", "sheet:0.2x0.2:0.0125:alternating")
    yield ("--mesh: found sheet:0.2x0.2:0.0125:alternating (289 vertices), the search behind the asset had sheet:0.2x0.2:0.025:alternating" in done.stderr,
           f"replay on another mesh: {done.stderr}")
    done = program.must(*replay, *mesh, "--grasp-shape", "point", "--time-step", "0.005")
    for words in ("--grasp-shape: found point, the search behind the asset had clamp",
                  "--time-step: found 0.005, the search behind the asset had 0.01"):
        yield words in done.stderr, f"replay, {words}: {done.stderr}"
    done = program.call(options.sysid, "grid", recording, "--asset", asset, "--bending", "1e-4,1.1e-4", "--no-solver-check",
                        "--no-horizon", "--no-plan", "--quiet", "-o", folder / "untold")
    yield done.returncode == 3, f"grid over 10 % of D: exit code {done.returncode}"
    for verb, code in (("report", 0), ("export", 3)):
        done = program.call(options.sysid, verb, folder / "untold", "--quiet", "-o", folder / f"untold_{verb}")
        yield done.returncode == code, f"{verb} of what cannot be used: exit code {done.returncode}, expected {code}: {done.stderr}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, type=pathlib.Path, help="the program flash-sim")
    parser.add_argument("--sysid", required=True, type=pathlib.Path, help="the program flash-sysid")
    parser.add_argument("--calib", type=pathlib.Path, help="the program flash-calib")
    options = parser.parse_args()
    done, failed = 0, 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        write_inputs(folder)
        program.synthesize(options.sysid, folder)
        for check in (check_refusals, check_accepted, check_lost_results, check_signals, check_two_runs, check_defaults,
                      check_resume, check_order, check_file_limit, check_collapse, check_fixed, check_killed_replay,
                      check_seams, check_fit, check_kept_motions, check_tuned):
            for holds, complaint in check(options, folder):
                done += 1
                failed += not holds
                if not holds:
                    print(complaint, flush=True)
    print(f"{done - failed} of {done} statements about how the programs end hold")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
