#!/usr/bin/env python3
"""flash-calib handeye on the public benchmark KinHEC (package kinhec, MIT): pairs of poses with known noise and truth, in
eight tracks. Of each sequence all methods get the same pairs: keyframes of the benchmark's protocol, asynchronous streams
paired by the true offset of their clocks. The table has for each track the sequences answered, those refused with their
causes, and those whose true camera pose lies inside of the stated 95 % region (chi-square, six degrees of freedom). Errors
are of the benchmark's X: the camera in the hand, or the target in the hand of a camera beside the robot. Their medians are
over sequences answered. The best baseline of a track is that with the least median translation. Where the scale of a track
is unknown (monocular), the size of the target is solved for.

    pip install kinhec
    tests/validation/kinhec.py --calib build/release/bin/flash-calib --tier smoke --out build/kinhec"""
import argparse
import collections
import json
import math
import pathlib
import subprocess
import sys

# kinhec is the package, not a file of this name beside this one.
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:] = [folder for folder in sys.path if pathlib.Path(folder or ".").resolve() != HERE]

try:
    import numpy
    from kinhec import benchmark, load_manifest, load_sequence, se3
    from scipy.spatial.transform import Rotation
except ImportError:
    benchmark = None

CHI_SQUARE_95_OF_6 = 12.592
UNKNOWN_SIZE = ("monocular",)  # tracks


def generated(tier, folder):
    """The sequences of a tier, made once."""
    data = folder / "data"
    if not (data / "sequences.parquet").exists():
        known = pathlib.Path(tier).resolve() if pathlib.Path(tier).exists() else tier
        subprocess.run([sys.executable, "-m", "kinhec", "generate", "--tier", known, "--out", data, "--no-card",
                        "--work-dir", folder / "work"], check=True, stdout=sys.stderr, cwd=folder)
    return data


def pose(transform):
    """Of a transform of flash-calib's JSON."""
    T = numpy.eye(4)
    T[:3, :3] = Rotation.from_quat(transform["rotation_xyzw"]).as_matrix()
    T[:3, 3] = transform["translation"]
    return T


def motion_between(T, other):
    """(dt, dtheta) with other = T [Exp(dtheta), dt]."""
    step = numpy.linalg.inv(T) @ other
    return numpy.concatenate([step[:3, 3], Rotation.from_matrix(step[:3, :3]).as_rotvec()])


def ask(calib, sequence, robot, target, options, folder):
    """Exit code, answer and the last line on stderr of a run on pairs of poses."""
    pairs, out = folder / f"{sequence.id}.npz", folder / f"{sequence.id}.json"
    numpy.savez(pairs, robot=robot, target=target)
    setup = "eye-in-hand" if sequence.eye_in_hand else "eye-to-hand"
    out.unlink(missing_ok=True)
    done = subprocess.run([calib, "handeye", pairs, "--setup", setup, "--threads", "1", "--force", "-o", out, *options],
                          capture_output=True, text=True)
    (folder / f"{sequence.id}.txt").write_text(done.stdout + done.stderr)
    lines = done.stderr.strip().splitlines()
    answer = json.loads(out.read_text()) if done.returncode in (0, 3) and out.exists() else None
    return done.returncode, answer, lines[-1] if lines else ""


def of_flash(sequence, answer):
    """Errors of X [deg, mm], and the squared distance of the camera's true pose by the stated covariance."""
    camera, target = pose(answer["transform"]), pose(answer["target_pose"])
    X, truth = (camera, sequence.X) if sequence.eye_in_hand else (target, sequence.Y)
    deg, mm = se3.pose_error(X, sequence.X)
    away = motion_between(camera, truth)
    square = float(away @ numpy.linalg.solve(numpy.array(answer["covariance"]), away))
    whole = not answer.get("one_axis") or answer["one_axis"]["told"]
    return {"deg": float(deg), "mm": float(mm), "square": square, "whole": whole}


def of_baselines(sequence, data):
    """Errors of X [deg, mm] by method; infinite where one fails."""
    errors = {}
    for name, solver in benchmark.SOLVERS.items():
        try:
            X = solver(data, numpy.random.default_rng(0))["X"]
            errors[name] = [float(error) for error in se3.pose_error(X, sequence.X)]
        except Exception:  # of any kind: a baseline that fails has no error
            errors[name] = [math.inf, math.inf]
    return errors


def study(calib, sequence, folder, extra=()):
    """One sequence: its row."""
    row = {"id": sequence.id, "track": sequence.manifest["track"], "level": sequence.manifest["level"]}
    data = benchmark._keyframe_data(sequence, None if sequence.synchronous else sequence.time_offset)
    if data is None:
        return {**row, "code": 2, "cause": "fewer than three frames"}
    robot, seen = data[0], data[1]
    target = se3.inverse(seen) if sequence.eye_in_hand else seen
    options = ["--target-size", "solved"] if row["track"] in UNKNOWN_SIZE else list(extra)
    code, answer, last = ask(calib, sequence, robot, target, options, folder)
    row |= {"pairs": len(robot), "code": code, "cause": "" if code == 0 else last}
    row["baselines"] = of_baselines(sequence, data)
    return {**row, "flash": of_flash(sequence, answer)} if answer else row


def best_baseline(rows):
    """Name and medians [deg, mm] of the one with the least median translation."""
    names = rows[0]["baselines"]
    medians = {name: numpy.median([row["baselines"][name] for row in rows], axis=0) for name in names}
    name = min(medians, key=lambda name: medians[name][1])
    return name, *medians[name]


def track_line(track, rows):
    """A line of the table."""
    answered = [row for row in rows if row["code"] == 0]
    whole = [row for row in answered if row["flash"]["whole"]]
    line = f"| {track} | {len(rows)} | {len(answered)} | {len(answered) - len(whole)} | {len(rows) - len(answered)} |"
    if not whole:
        return line + " - | - | - | - |"
    inside = sum(row["flash"]["square"] < CHI_SQUARE_95_OF_6 for row in answered)
    deg, mm = (float(numpy.median([row["flash"][measure] for row in whole])) for measure in ("deg", "mm"))
    name, best_deg, best_mm = best_baseline(whole)
    mark = "" if mm <= best_mm else " (behind)"
    return line + f" {inside} of {len(answered)} | {deg:.3f}, {mm:.2f}{mark} | {best_deg:.3f}, {best_mm:.2f} | {name} |"


def table(rows):
    """Markdown: tracks, then causes of refusals."""
    lines = ["| track | sequences | answered | of them in part | refused | inside 95 % | flash deg, mm | best baseline deg, mm | which |",
             "|---|---|---|---|---|---|---|---|---|"]
    tracks = collections.defaultdict(list)
    for row in rows:
        tracks[row["track"]].append(row)
    lines += [track_line(track, tracks[track]) for track in sorted(tracks)]
    lines += [track_line("all", rows), ""]
    lines += [f"- {row['id']} ({row['level']}): exit {row['code']}: {row['cause']}" for row in rows if row["code"] != 0]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", type=pathlib.Path, required=True, help="flash-calib")
    parser.add_argument("--tier", default="smoke", help="of kinhec: smoke, small, medium, full, or a YAML file")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for sequences, pairs and answers")
    parser.add_argument("--data", type=pathlib.Path, help="sequences that kinhec generate has written before")
    parser.add_argument("--size-known", action="store_true", help="state size of the target and lens as exact (--target-size-sd 0 --lens stated)")
    args = parser.parse_args()
    if benchmark is None:
        print("skipped: the package kinhec is not installed (pip install kinhec)")
        return
    args.out = args.out.resolve()
    answers = args.out / "answers"
    answers.mkdir(parents=True, exist_ok=True)
    data = args.data or generated(args.tier, args.out)
    manifest = load_manifest(data)
    extra = ["--target-size-sd", "0", "--lens", "stated"] if args.size_known else []
    sequences = (load_sequence(data, name, manifest) for name in manifest["sequence_id"])
    rows = [study(args.calib.resolve(), sequence, answers, extra) for sequence in sequences]
    (args.out / "rows.json").write_text(json.dumps(rows, indent=1))
    print(table(rows))


if __name__ == "__main__":
    main()
