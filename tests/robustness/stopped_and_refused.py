#!/usr/bin/env python3
"""Stops flash-sysid in the middle of a candidate of hundreds of thousands of steps, asks it for jobs without end, and
gives it recordings whose names are paths, are the same, or are twice the same recording."""
import argparse
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import program

HANG = 120  # seconds after which a job that was asked to stop counts as hanging
LONG = ["--time-step", "3e-6"]  # 200,000 steps a candidate
AXES = ["--bending", "1e-4,2e-4", "--no-solver-check", "--no-horizon"]
failures = []


def expect(condition, what, found=""):
    if not condition:
        failures.append(f"{what}: {found}")


def start(*words):
    """A job that has begun to catch signals."""
    job = subprocess.Popen([*map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    caught, status = 0, pathlib.Path(f"/proc/{job.pid}/status")
    while not caught & 1 << (signal.SIGTERM - 1) and job.poll() is None:
        time.sleep(0.01)
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines() if ":" in line)
        caught = int(lines.get("SigCgt", "0"), 16)
    return job


def end(job):
    try:
        return job.communicate(timeout=HANG)[1]
    except subprocess.TimeoutExpired:
        job.kill()
        job.communicate()
        return "does not end"


def ends_in_time(sysid, root, asset, recording):
    """--max-hours ends a search as a signal does, and the same command goes on; other numbers are refused."""
    out = root / "in_time"
    words = [sysid, "grid", recording, "--asset", asset, *AXES, "--resume", "-o", out, "--max-hours"]
    for last in ("0", "-1", "nan", "soon"):
        done = program.call(*words, last)
        expect(done.returncode == 2 and "--max-hours" in done.stderr, f"--max-hours {last}", done.stderr)
        expect(not out.exists(), f"--max-hours {last}: leaves nothing")
    done = program.call(*words, "3e-4", *LONG)  # 1 s of some minutes
    expect(done.returncode == 1, "--max-hours: exit code", f"{done.returncode} {done.stderr}")
    expect("the time of --max-hours is over" in done.stderr, "--max-hours: says why", done.stderr)
    expect("kept in" in done.stderr and "--resume goes on" in done.stderr, "--max-hours: what is kept", done.stderr)
    again = program.call(*words, "3e-4", *LONG)
    expect(again.returncode == 1 and "other" not in again.stderr, "--max-hours: goes on", again.stderr)
    shutil.rmtree(out, ignore_errors=True)
    done = program.call(*words, "1")
    expect(done.returncode in (0, 3) and "--max-hours" not in done.stderr, "--max-hours that is not reached", done.stderr)
    shutil.rmtree(out, ignore_errors=True)


def stops(sysid, root, asset, recording, run):
    common = ["--asset", asset]
    jobs = {
        "grid": [recording, *common, *AXES, *LONG],
        "replay": [recording, *common, *LONG],
        "fit": [recording, *common, "--start", run, *LONG],
        "plan": [recording, *common, "--time-step", "4e-6"],
        "synth": [*common, "--duration", "0.6", "--mesh", "sheet:0.2x0.2:0.02:alternating", "--time-step", "3e-6"],
    }
    for verb, words in jobs.items():
        out = root / f"stopped_{verb}"
        for number in (signal.SIGINT, signal.SIGTERM):
            job = start(sysid, verb, *words, "-o", out)
            while verb == "grid" and not (out / "grid.json").exists() and job.poll() is None:
                time.sleep(0.01)
            time.sleep(0.3)  # into its steps
            job.send_signal(number)
            error = end(job)
            expect(job.returncode == 1, f"{verb}: exit code after {number.name}", f"{job.returncode} {error}")
            expect("stopping after this step" in error, f"{verb}: answers {number.name}", error)
            if verb != "grid":
                expect("stopped before the end; nothing was written" in error, f"{verb}: says so", error)
                expect(not out.exists(), f"{verb}: leaves nothing")
                continue
            expect("stopped with 0 of 2 candidates" in error, "grid: says what it keeps", error)
            results = (out / "results.csv").read_text() if out.exists() else ""
            expect(results.count("\n") == 1, "grid: keeps no part of a candidate", results)
            shutil.rmtree(out, ignore_errors=True)
    ends_in_time(sysid, root, asset, recording)
    # Both signals wait until the job goes on: the second finds that the first has asked already.
    job = start(sysid, "replay", *jobs["replay"], "-o", root / "twice")
    for number in (signal.SIGSTOP, signal.SIGINT, signal.SIGTERM, signal.SIGCONT):
        job.send_signal(number)
    error = end(job)
    expect(job.returncode in (128 + signal.SIGINT, 128 + signal.SIGTERM), "second signal", f"{job.returncode} {error}")


def wait_for(job, line):
    while line not in (job.stderr.readline() or line):
        pass


def stops_late(sysid, root, asset, recording, run):
    """Signals after a first result: in the optimizer and its last phase, and while pictures are written."""
    out = root / "stopped_late"

    def ended(job, what, *reasons):
        error = end(job)
        said = "stopping after this step" in error
        expect(job.returncode == 1 if said else job.returncode in (0, 3), what, f"{job.returncode} {error}")
        expect(not said or any(reason in error for reason in reasons), f"{what}: says what is there", error)
        expect("Logging" not in error and "Terminating" not in error, f"{what}: log of a library", error)
        expect("nothing was written" not in error or not out.exists(), f"{what}: leaves nothing", error)
        shutil.rmtree(out, ignore_errors=True)

    for number in (signal.SIGINT, signal.SIGTERM):
        job = start(sysid, "replay", recording, "--asset", asset, "--every-step", "--time-step", "1e-3", "-o", out)
        while not any(root.glob("stopped_late*/steps")) and job.poll() is None:
            time.sleep(0.001)
        job.send_signal(number)
        ended(job, f"replay: {number.name} while it writes", "nothing was written", "it is written")


def plans(sysid, root, asset):
    """A mesh whose edges have no vertex in the middle; what a killed plan leaves."""
    scratch = root / "scratch"
    scratch.mkdir()
    environment = {**os.environ, "TMPDIR": str(scratch)}
    made = root / "even"
    program.must(sysid, "synth", "--asset", asset, "--mesh", "sheet:0.2x0.2:0.04:alternating", "--duration", "0.2", "--quiet",
                 "-o", made)
    words = [sysid, "plan", made, "--asset", asset, "--bending", "1e-5,1e-4", "--time-step", "0.02"]
    done = program.call(*words, "-o", root / "plan.json", env=environment)
    expect(done.returncode == 0 and (root / "plan.json").exists(), "plan of a mesh of even edges", done.stderr)
    job = subprocess.Popen([*map(str, words), "-o", str(root / "killed.json")], stderr=subprocess.PIPE, text=True,
                           env=environment)
    wait_for(job, "simulating hang")
    job.kill()
    job.communicate()
    expect(not list(scratch.iterdir()), "plan leaves nothing behind", list(scratch.iterdir()))


def unconverged(sysid, root, asset, recording):
    out = root / "unconverged"
    done = program.call(sysid, "replay", recording, "--asset", asset, "--iterations", "1", "--tolerance", "1e-12",
                        "-o", out)
    expect(done.returncode == 3 and "not converged in" in done.stderr, "replay of unconverged steps",
           f"{done.returncode} {done.stderr}")
    expect((out / "overlay.csv").exists(), "replay of unconverged steps writes its files")


def absurd_candidate(sysid, root, recording):
    """One of sixteen that no solver converges for: it is named, and the others are as they are without it."""
    props = program.ASSET["mechanical_props"] | {"young": 50}  # N/m: without a thickness
    del props["thickness"]
    asset = root / "no_thickness.json"
    asset.write_text(json.dumps(program.ASSET | {"mechanical_props": props}))
    values = [20 * k for k in range(1, 16)]
    rows = []
    for name, more in (("alone", []), ("beside", ["1e13"])):
        done = program.call(sysid, "grid", recording, "--asset", asset, "--young", ",".join(map(str, values + more)),
                            "--no-solver-check", "--no-horizon", "--no-plan", "-o", root / name)
        expect(done.returncode in (0, 3), f"search {name} an absurd candidate", f"{done.returncode} {done.stderr}")
        lines = (root / name / "results.csv").read_text().splitlines()[1:]
        rows.append([line.rsplit(",", 1)[0] for line in lines])  # the digest is of the search too
        said = "1 of 16 candidates did not converge in every step: number 15 of results.csv" in done.stderr
        expect(said == (name == "beside"), f"{name} an absurd candidate", done.stderr)
    expect(rows[1][:15] == rows[0], "what is found beside an absurd candidate", rows)
    expect(len(rows[1]) == 16 and "unconverged" in rows[1][-1], "the absurd candidate", rows[1][-1:])


def lock_comes_first(sysid, root, asset, recording):
    out = root / "locked"
    job = start(sysid, "grid", recording, "--asset", asset, *AXES, *LONG, "-o", out)
    while not (out / "grid.json").exists() and job.poll() is None:
        time.sleep(0.01)
    second = program.call(sysid, "grid", recording, "--asset", asset, *AXES, "--force", "-o", out)
    expect(second.returncode == 2 and "another run is writing to it" in second.stderr, "--force beside a search",
           second.stderr)
    for verb, words in {"replay": [recording, "--asset", asset], "fit": [recording, "--start", root / "run"],
                        "synth": ["--asset", asset, "--duration", "0.2"], "segment": [recording / "frames"]}.items():
        other = program.call(sysid, verb, *words, "--force", "-o", out, timeout=HANG)
        expect(other.returncode == 2 and other.stderr.count("\n") == 1 and "another run is writing to it" in other.stderr,
               f"{verb} --force beside a search", other.stderr)
    names = sorted(path.name for path in out.iterdir() if path.name != "motions")
    expect(names == [".lock", "grid.json", "keyframes.csv", "registrations.csv", "results.csv"], "files beside a search", names)
    for name in ("grid.json", "results.csv", "registrations.csv", "keyframes.csv"):
        expect((out / name).exists(), f"--force beside a search removes {name}")
    job.terminate()
    end(job)


def names(sysid, root, asset, recording):
    def copy(folder, name):
        shutil.copytree(recording, folder)
        data = json.loads((folder / "recording.json").read_text())
        data["name"] = name
        if folder.parent.name == "day2":
            data["keyframes"].pop()  # another day: not the same observations
        (folder / "recording.json").write_text(json.dumps(data))
        return folder

    search = ["--asset", asset, *AXES]
    victim = root / "victim"
    victim.mkdir()
    (victim / "000_mesh.ply").write_text("mine")
    run = root / "named" / "run"
    done = program.call(sysid, "grid", copy(root / "path", "../../../victim"), *search, "-o", run)
    expect(done.returncode in (0, 3), "a name that is a path", done.stderr)
    expect((victim / "000_mesh.ply").read_text() == "mine", "a name that is a path overwrites a file")
    expect([path.name for path in (run / "best").iterdir()] == ["_._.._.._victim"], "folder of such a name")
    expect(program.call(sysid, "report", run).returncode == 0, "its report")
    done = program.call(sysid, "grid", copy(root / "long", "x" * 5000), *search, "-o", root / "long_run")
    expect(done.returncode in (0, 3), "a name of 5,000 letters", done.stderr[:300])

    days = [copy(root / "day1" / "lift", "lift"), copy(root / "day2" / "lift", "lift")]
    run = root / "days"
    done = program.call(sysid, "grid", *days, *search, "-o", run)
    expect(done.returncode in (0, 3), "two recordings of one name", done.stderr)
    summary = json.loads((run / "summary.json").read_text())
    expect([each["name"] for each in summary["recordings"]] == ["lift", "lift_2"], "names in the summary")
    expect(sorted(path.name for path in (run / "best").iterdir()) == ["lift", "lift_2"], "folders of two days")
    registered = {line.split(",")[1] for line in (run / "registrations.csv").read_text().splitlines()[1:]}
    expect(registered == {"lift", "lift_2"}, "names in registrations.csv", registered)
    expect(done.stderr.count("2 of 2 candidates") == 1, "progress without a terminal", done.stderr)
    (root / "link").symlink_to(days[0])
    for same in (days[0], root / "link"):
        done = program.call(sysid, "grid", days[0], same, *search, "-o", root / "same")
        expect(done.returncode == 2 and "is the same recording as" in done.stderr, "one recording twice", done.stderr)
        expect(not (root / "same").exists(), "a refused search leaves nothing")
    done = program.call(sysid, "grid", *days, *search, "--quiet", "-o", root / "quiet")
    expect("candidates," not in done.stderr, "--quiet", done.stderr)


def refusals(sysid, root, asset, recording):
    out = root / "refused"
    replay, grid = ["replay", recording, "--asset", asset], ["grid", recording, "--asset", asset]
    synth = ["synth", "--asset", asset, "--quiet"]
    axis = ["--bending", "1e-4,2e-4"]
    cases = [
        ([*replay, "--time-step", "2e-7"], "--time-step: found 2e-07 s"),
        ([*grid, *axis, "--time-step", "2e-7"], "--time-step: found 2e-07 s"),
        ([*grid, "--bending", "1e-6:1e-3:100000", "--friction", "0.1:1:100000"], "expected at most 1,000,000"),
        ([*grid, *axis, "--iterations", "2147483647", "--tolerance", "1e-300"], "--iterations"),
        ([*grid, *axis, "--tolerance", "1e-300"], "--tolerance"),
        ([*grid, "--bending", "1e-4,1e-4"], "--bending: 0.0001 is given twice"),
        ([*grid, *axis, "--from", "3"], "--from, --until: "),
        ([*grid, *axis, "--distance", "huber", "--trim", "0.1"], "--trim: found --distance huber"),
        ([*replay, "--huber", "0.1"], "--huber: found --distance trimmed"),
        ([*grid, *axis, "--sigma", "cloud=0.001", "--sigma", "cloud=0.002"], "--sigma cloud: given twice"),
        ([*grid, *axis, "--grasp-within", "0.11"], "--grasp-within: found 0.11 m, expected at most half"),
        ([*replay, "--grasp-within", "20"], "--grasp-within: found 20 m, expected at most half"),
        ([*synth, "--grasp-within", "5"], "--grasp-within: found 5 m, expected at most half"),
        (["plan", recording, "--run", root / "run", "--error", "0.01"], "--error: found it beside --run"),
        (["plan", recording, "--asset", asset, "--time-step", "2e-6"], "--time-step: found 2e-06 s"),
        ([*replay, "--time-step", "1e9"], "--time-step: found \"1e9\", expected a number from 1e-07 to 1"),
        ([*synth, "--time-step", "1e300"], "--time-step: found \"1e300\", expected a number from 1e-07 to 1"),
        ([*synth, "--rate", "1e9"], "--rate: found 1e+09"),
        ([*synth, "--duration", "1e9"], "--duration: found 1e+09"),
        ([*synth, "--camera", "nan,0,0"], "--camera"),
        ([*synth, "--displacement", "1e300", "0", "0"], "--displacement"),
    ]
    for words, needle in cases:
        done = program.call(sysid, *words, "-o", out, timeout=HANG)
        name = " ".join(map(str, words[1:]))
        expect(done.returncode == 2, f"{name}: exit code", f"{done.returncode} {done.stderr}")
        expect(needle in done.stderr and done.stderr.count("\n") == 1, f"{name}: message", done.stderr)
        expect(not out.exists(), f"{name}: leaves nothing")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    sysid = parser.parse_args().sysid
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(temporary)
        asset, recording = program.synthesize(sysid, root)
        run = root / "run"
        done = program.call(sysid, "grid", recording, "--asset", asset, *AXES, "--quiet", "-o", run)
        expect(done.returncode in (0, 3), "grid", done.stderr)
        refusals(sysid, root, asset, recording)
        names(sysid, root, asset, recording)
        lock_comes_first(sysid, root, asset, recording)
        stops(sysid, root, asset, recording, run)
        stops_late(sysid, root, asset, recording, run)
        plans(sysid, root, asset)
        unconverged(sysid, root, asset, recording)
        absurd_candidate(sysid, root, recording)
    if failures:
        sys.exit("\n".join(failures))
    print("all stopped, refused and kept apart as they should be")


if __name__ == "__main__":
    main()
