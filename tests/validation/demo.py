#!/usr/bin/env python3
"""The main job of `make demo`, whose commands this reads from the Makefile: README has the same, the recorded truth lies inside
the intervals that it ends with, and the tuned asset has the estimates and is replayed to the score of the search."""
import argparse
import json
import pathlib
import re
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def commands(sysid, out):
    target = re.search(r"^demo:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE).group(1)
    lines = [line for line in target.replace("\\\n", " ").splitlines() if "$(sysid)" in line]
    return [shlex.split(line.strip().replace("$(sysid)", sysid).replace("$(DEMO)", str(out))) for line in lines]


def missing_in_readme():
    """Commands of the demo that README does not have, word for word but for --force and what follows."""
    readme = " ".join((ROOT / "README.md").read_text().replace("\\\n", " ").split())
    lines = [" ".join(word for word in command if word != "--force") for command in commands("flash-sysid", "demo")]
    return [line for line in lines if line not in readme]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    options = parser.parse_args()
    if missing := missing_in_readme():
        sys.exit(f"README.md does not have: {missing}")
    for command in commands(options.sysid, options.out):
        subprocess.run(command, cwd=ROOT, check=True)
    truth = json.loads((options.out / "recording/truth.json").read_text())["parameters"]
    found = json.loads((options.out / "run/summary.json").read_text())["parameters"]
    tuned = json.loads((options.out / "tuned.json").read_text())["identification"]["estimate"]
    wrong = [name for name, finding in found.items()
             if finding["identifiable"] != "yes" or tuned[name] != finding["estimate"]
             or not finding["interval95"][0] <= truth[name] <= finding["interval95"][1]]
    if wrong or len(found) != 2:
        sys.exit(f"not told, or not as exported: {', '.join(wrong)}")
    replayed = subprocess.run([options.sysid, "replay", options.out / "lift", "--asset", options.out / "tuned.json", "--force",
                               "--json", "-o", options.out / "check"], check=True, capture_output=True, text=True)
    score = json.loads(replayed.stdout)["score"]
    searched = json.loads((options.out / "run/summary.json").read_text())["best"]["score_on_mesh"]
    # The asset has every digit of the estimate: what is left is rounding, as solved steps pass it on.
    if abs(score - searched) > 1e-4 * searched or "score is" in replayed.stderr:
        sys.exit(f"replay of tuned.json scores {score}, the search had {searched}: {replayed.stderr}")


if __name__ == "__main__":
    main()
