"""One seed each of the studies of synthetic.py: truth found, verdicts right and the same whatever `kind`
says, memory as told."""
import argparse
import os
import pathlib
import re
import shutil
import subprocess

import synthetic
from runs import Runs

SEED = 141


def check(what, value, good):
    print(f"{'ok    ' if good else 'WRONG '} {what}: {value}")
    return good


def told_and_used_memory(runs):
    """[MB] of a search, as it says before it begins, and at its peak."""
    asset = synthetic.write_asset(runs.out)
    recording = runs.synth("memory/recording", asset, "--mesh", synthetic.FIT, *synthetic.LIFT)
    command = [runs.sysid, "grid", recording, "--asset", asset, "--mesh", synthetic.STRIP + "0.0025", "--clamp-slopes", "--bending",
               "1e-4:4e-4:3:log", "--no-horizon", "--threads", "2", "--rollouts", runs.out / "memory/rollouts", "-o",
               runs.out / "memory/run", "--force"]
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    told = re.search(r"about ([\d,]+) MB", process.stdout.read())
    _, _, usage = os.wait4(process.pid, 0)
    return float(told[1].replace(",", "")), usage.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder; what it holds of an earlier run goes")
    options = parser.parse_args()
    folder = options.out / "seeded_subset"
    shutil.rmtree(folder, ignore_errors=True)
    runs = Runs(options.sysid, folder)

    bending = 1e-4
    _, allowed, _, _ = synthetic.BENDING[bending]
    lifted = synthetic.lift(runs, bending, SEED)
    relabelled = synthetic.lift(runs, bending, SEED, "free")
    pulled = synthetic.bar_pull(runs, SEED)["parameters"]
    D = lifted["parameters"]["bending"]["estimate"]
    young, poisson = pulled["young"], pulled["poisson"]
    told, used = told_and_used_memory(runs)
    results = [
        check("lift: D [N m]", D, abs(D / bending - 1) <= allowed),
        check("lift: verdicts", synthetic.verdicts(lifted), synthetic.verdicts(lifted) == {"poisson": "no", "bending": "yes"}),
        check("lift called `free`: verdicts", synthetic.verdicts(relabelled),
              synthetic.verdicts(relabelled) == synthetic.verdicts(lifted)),
        check("bar pull: E t [N/m]", young["estimate"], abs(young["estimate"] / synthetic.BAR_MATERIAL["young"] - 1) <= 0.03),
        check("bar pull: nu", poisson["estimate"], abs(poisson["estimate"] - synthetic.BAR_MATERIAL["poisson"]) <= 0.03),
        check("bar pull: verdicts", (young["identifiable"], poisson["identifiable"]),
              young["identifiable"] == poisson["identifiable"] == "yes"),
        check("memory told and used [MB]", (told, round(used)), used <= 1.2 * told and told <= 2 * used)]
    return 0 if all(results) else 1


if __name__ == "__main__":
    raise SystemExit(main())
