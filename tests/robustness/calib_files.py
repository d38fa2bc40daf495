#!/usr/bin/env python3
"""Files and words of flash-calib. What it writes never takes the place of a file that the run reads, whatever the option and
however the path leads there; a full disk leaves none of several results. What it cannot take is refused in one line. Files of
one name are two arms."""
import argparse
import hashlib
import json
import os
import pathlib
import re
import resource
import shutil
import sys
import tempfile

import program

BOARD = "chessboard:9x6:0.025"
FAILED, REFUSED = 1, 2


def digests(folder):
    """Of all files, links followed."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*")) if path.is_file()}


def draw(tool, work):
    for name, setup, seed in (("wrist", "eye-in-hand", 1), ("left", "eye-to-hand", 2), ("right", "eye-to-hand", 3)):
        program.must(tool, work / name, setup, BOARD, 12, "640x480", "0.02", "0.2", seed)
        shutil.rmtree(work / name / "truth")
    (work / "corners").symlink_to("wrist/images")
    (work / "link.png").symlink_to("wrist/images/000.png")
    os.link(work / "wrist/images/001.png", work / "hard.png")
    (work / "target.txt").write_text('{"target": "%s"}' % BOARD)
    (work / "options.toml").write_text("[handeye]\nthreads=1\n")
    (work / "bare").mkdir()
    (work / "bare/target.json").write_text('{"setup": "eye-in-hand", "target": "%s"}' % BOARD)
    shutil.copytree(work / "wrist/images", work / "bare/corners")


def overwrites(calib):
    """Command line, and the path that is refused."""
    handeye = [calib, "handeye", "wrist"]
    options = ("-o", "--report", "--ros", "--urdf", "--easy-handeye2", "--camera-info")
    yield from (([*handeye, option, "wrist/images/000.png"], "wrist/images/000.png") for option in options)
    for path in ("wrist/poses.tum", "wrist/camera_info.yaml", "wrist/target.json", "link.png", "hard.png",
                 "left/../wrist/images/002.png", "corners/003.png"):
        yield [*handeye, "--ros", path], path
    yield [*handeye, "--target", "target.txt", "--ros", "target.txt"], "target.txt"
    yield [*handeye, "--camera", "left/camera_info.yaml", "-o", "left/camera_info.yaml"], "left/camera_info.yaml"
    yield [calib, "--config", "options.toml", "handeye", "wrist", "-o", "options.toml"], "options.toml"
    for verb in ("detect", "intrinsics", "plan"):
        for path in ("wrist/images/000.png", "wrist/target.json", "wrist/poses.tum"):
            yield [calib, verb, "wrist", "-o", path], path
    for path in ("left/camera.json", "right/target.json", "left/images/000.png"):
        yield [calib, "register", "left/camera.json", "right/camera.json", "-o", path], path
    yield [calib, "register", "--cameras", "left", "right", "-o", "right/images/000.png"], "right/images/000.png"
    validate = [calib, "validate", "wrist", "--extrinsics"]
    yield [*validate, "validation.json", "-o", "."], "./corners/000.png"
    yield [calib, "validate", "bare/corners", "--camera", "wrist/camera_info.yaml", "--poses", "wrist/poses.tum", "--target",
           BOARD, "--extrinsics", "wrist/camera.json", "-o", "bare"], "bare/corners/000.png"


def check_inputs_are_kept(calib, work):
    for name in ("wrist", "left", "right"):
        program.must(calib, "handeye", work / name, "-o", work / name / "camera.json", "--cache", work / "cache")
    shutil.copy(work / "wrist/camera.json", work / "validation.json")
    before = digests(work)
    for words, path in overwrites(calib):
        done = program.call(*words, "--force", cwd=work, timeout=60)
        where = " ".join(map(str, words[1:]))
        lines = [line for line in done.stderr.splitlines() if "warning:" not in line]
        yield done.returncode == REFUSED, f"{where}: exit code {done.returncode}: {done.stderr[-500:]}"
        yield len(lines) == 1 and lines[0].startswith(f"flash-calib: {path}: is read by this run"), f"{where}: {lines}"
        after = digests(work)
        changed = sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))
        yield not changed, f"{where}: changed {changed}"
        for name in changed:
            sys.exit(f"{where}: changed {changed}: nothing else can be tried")


def check_full_disk(calib, work):
    """Files may grow to no more than so many bytes: the report is larger than the extrinsics, a cache file than 200 bytes."""
    def grow_to(size):
        return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    out = work / "full.json"
    size = (work / "wrist/camera.json").stat().st_size + 1000
    yield (work / "wrist/camera.html").stat().st_size > size, "the report is no larger than the extrinsics"
    done = program.call(calib, "handeye", work / "wrist", "-o", out, preexec_fn=grow_to(size))
    yield done.returncode == FAILED, f"a full disk: exit code {done.returncode}: {done.stderr}"
    yield not list(work.glob("full*")), f"a full disk: left {list(work.glob('full*'))}"
    out.write_text("mine")
    program.call(calib, "handeye", work / "wrist", "--force", "-o", out, preexec_fn=grow_to(size))
    yield out.read_text() == "mine", "a full disk: a former result is gone"
    done = program.call(calib, "handeye", work / "wrist", "--cache", work / "new_cache", preexec_fn=grow_to(200))
    yield done.returncode == 0, f"a full disk under the cache: exit code {done.returncode}: {done.stderr}"
    yield done.stderr.count("what is found is not kept") == 1, f"a full disk under the cache: {done.stderr}"


def spoilt(work, name, change):
    content = json.loads((work / "wrist/camera.json").read_text())
    change(content)
    (work / name).write_text(json.dumps(content))
    return name


def refusals(calib, work):
    """Command line, words of the one line that refuses it."""
    far = spoilt(work, "far.json", lambda c: c["transform"].update(translation=[1e300, 0, 0]))
    negative = spoilt(work, "negative.json", lambda c: c["covariance"][0].__setitem__(0, -1))
    huge = spoilt(work, "huge.json", lambda c: c["covariance"][0].__setitem__(0, 1e300))
    form = {"translation": {"x": 1e300, "y": 0, "z": 1}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    near = {"translation": {"x": 0, "y": 0, "z": 1}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    (work / "pairs.samples").write_text(json.dumps({"samples": [{"robot": near, "tracking": near}] * 5}))
    (work / "far.samples").write_text(json.dumps({"samples": [{"robot": form, "tracking": near}] + [{"robot": near, "tracking": near}] * 4}))
    (work / "names.samples").write_text(json.dumps({"samples": [{"robot": near, "optical": near}]}))
    for name, content in (("cut", "{"), ("nothing", ""), ("odd", '{"schema": x}')):
        (work / f"{name}.json").write_text(content)
    (work / "poses.csv").write_text("index,pos_x,pos_y,pos_z,qx,qy,qz,qw\n0,1,1,1,0,0,0,1\n")
    info = (work / "wrist/camera_info.yaml").read_text()
    for name, content in (("empty", ""), ("minus", re.sub(r"data: \[", "data: [-", info, count=1)),
                          ("rows", info.replace("rows: 3", "rows: 4", 1)), ("bytes", 'a: "\\\xff"\n')):
        (work / f"{name}.yaml").write_bytes(content.encode("latin-1"))
    metres = json.loads((work / "wrist/camera.json").read_text())["transform"]["translation"]
    spoilt(work, "mm.json", lambda c: c["transform"].update(translation=[500 + 1000 * x for x in metres]))
    shutil.copytree(work / "left", work / "again")
    (work / "again/images/003.png").unlink()
    validate = [calib, "validate", "wrist", "--extrinsics"]
    plan = [calib, "plan", "wrist", "--cache", "cache"]
    pairs = [calib, "handeye", "pairs.samples", "--setup", "eye-in-hand"]
    handeye = [calib, "handeye", "wrist"]
    return [
        ([*validate, far], ["far.json: transform.translation", "metres, below 10,000"]),
        ([*validate, negative], ["negative.json: covariance", "no variance below 0"]),
        ([*validate, huge], ["huge.json: covariance", "numbers below 1e8"]),
        ([*validate, "cut.json"], ["cut.json: not valid JSON: line 1, column 2: it ends within a value"]),
        ([*validate, "nothing.json"], ["nothing.json: not valid JSON: it is empty"]),
        ([*validate, "odd.json"], ["odd.json: not valid JSON: line 1, column 12: found x"]),
        ([*validate, "wrist/camera.json", "-o", "far.json"], ["far.json: exists already, and is no folder"]),
        ([calib, "handeye", "far.samples", "--setup", "eye-in-hand"], ["far.samples", "1e+300 m away"]),
        ([calib, "handeye", "names.samples", "--setup", "eye-in-hand"], ["found robot, optical, expected robot and tracking"]),
        ([calib, "detect", "pairs.samples", "--target", BOARD], ["pairs.samples: found pairs of poses, expected pictures"]),
        ([calib, "intrinsics", "pairs.samples"], ["pairs.samples: found pairs of poses, expected pictures"]),
        ([calib, "detect", "wrist", "--target", "chessboard:99999x99999:0.025"], ["COLUMNSxROWS of 3 to 1000"]),
        ([*validate, "mm.json"], ["mm.json: translation: found a camera ", "are these millimetres?"]),
        ([*validate, "wrist/camera.json", "--force", "-o", "wrist"], ["wrist: holds wrist/", "expected another folder"]),
        ([*pairs, "--target", BOARD], ["--target: found pairs of poses, pairs.samples"]),
        ([*pairs, "--camera-info", "lens.yaml"], ["--camera-info: found pairs of poses"]),
        ([calib, "validate", "pairs.samples", "--extrinsics", "wrist/camera.json", "--camera", "wrist/camera_info.yaml"],
         ["--camera: found pairs of poses"]),
        ([calib, "intrinsics", "wrist", "-o", "lens.json"], ['lens.json", expected a name that ends in .yaml or .yml']),
        ([calib, "register", "--cameras", "left", "again"], ["again: its picture 000.png is picture 000.png of left"]),
        ([*plan, "--reach", "1e9"], ["--reach", "expected a number from 0 to 10"]),
        ([*plan, "--lower", "200,-400,100", "--upper", "700,400,600"], ["--lower, --upper: found 200 to 700 m along x"]),
        ([*handeye, "--poses", "poses.csv"], ["found index, pos_x, pos_y, pos_z", "expected tx, ty, tz [m]"]),
        ([*handeye, "--camera", "empty.yaml"], ["empty.yaml: is empty"]),
        ([*handeye, "--camera", "minus.yaml"], ["found a focal length of -", "expected one above 0"]),
        ([*handeye, "--camera", "rows.yaml"], ["found 9 numbers, expected as many as rows times cols"]),
        ([*handeye, "--camera", "bytes.yaml"], ["bytes.yaml: not valid YAML: line 1"]),
        ([*handeye, "--bogus"], ["--bogus: unknown option (see --help)"]),
        ([*handeye, "left"], ["left: found a word that no option takes"]),
        ([*handeye, "--threads", "0", "--threads", "1"], ["--threads: given twice, expected once"]),
        ([*plan, "--seed", "-1"], ['found "-1"', "expected a whole number"]),
        ([*plan, "--lower", "1,1,1", "--upper", "0,0,0"], ["--lower: found 1 along x, expected at most --upper, 0"]),
        ([calib, "register", "left/camera.json", "right/camera.json", "--workspace", "1e300,0,0"],
         ["--workspace: found 1e+300", "at most 100"])]


def check_refusals(calib, work):
    for words, expected in refusals(calib, work):
        done = program.call(*words, cwd=work, timeout=60)
        where = " ".join(map(str, words[1:]))
        lines = [line for line in done.stderr.splitlines() if "warning:" not in line]
        yield done.returncode == REFUSED and len(lines) == 1, f"{where}: exit code {done.returncode}: {done.stderr[-500:]}"
        yield all(word in done.stderr for word in expected), f"{where}: does not say {expected}: {done.stderr[-500:]}"
        yield "inf" not in done.stderr.split() and "\ufffd" not in done.stderr, f"{where}: {done.stderr[-500:]}"


def check_arms(calib, work):
    """left/camera.json and right/camera.json are two arms, as left.json and right.json are."""
    for name in ("left", "right"):
        program.must(calib, "handeye", work / name, "-o", work / f"{name}.json", "--cache", work / "cache")
    cells = []
    for calibrations in (("left/camera.json", "right/camera.json"), ("left.json", "right.json")):
        for more in ((), ("--without-images",)):
            done = program.call(calib, "register", *calibrations, "--json", "--cache", work / "cache", *more, cwd=work)
            yield done.returncode == 0, f"register {calibrations}: exit code {done.returncode}: {done.stderr}"
            cell = json.loads(done.stdout)
            names = [[base["parent"], base["child"]] for base in cell["bases"]]
            expected = [name.removesuffix(".json") for name in calibrations]
            yield names == [expected], f"register {calibrations}: bases {names}, expected {[expected]}"
            cells.append([base["translation"] for base in cell["bases"]])
    yield cells[:2] == cells[2:], f"register: by other names the bases are elsewhere: {cells}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        draw(options.draw, work)
        results = list(check_inputs_are_kept(options.calib, work))
        for check in (check_full_disk, check_arms, check_refusals):
            results += check(options.calib, work)
    sys.exit(program.conclude(results))


if __name__ == "__main__":
    main()
