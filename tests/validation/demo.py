#!/usr/bin/env python3
"""The main job of `make demo`, as the page Start in ten minutes left it: README and that page have the commands of the Makefile, the
recorded truth lies inside the intervals, and the tuned asset has the estimates and is replayed to the score of the search."""
import argparse
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDING = ROOT / "examples/towel_lift"


def commands():
    target = re.search(r"^demo:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE).group(1)
    lines = [line for line in target.replace("\\\n", " ").splitlines() if "$(sysid)" in line]
    return [line.strip().replace("$(sysid)", "flash-sysid").replace("$(DEMO)", "demo") for line in lines]


def words(text):
    """One blank between words, --force left out."""
    return " ".join(word for word in text.replace("\\\n", " ").split() if word != "--force")


def missing():
    """Commands of the demo that a page does not have, word for word but for --force."""
    pages = {name: words((ROOT / name).read_text()) for name in ("README.md", "docs/start.md")}
    return [f"{name}: {words(line)}" for name, text in pages.items() for line in commands() if words(line) not in text]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--demo", required=True, type=pathlib.Path, help="what the commands left")
    options = parser.parse_args()
    if absent := missing():
        sys.exit("\n".join(["commands of make demo that a page does not have:", *absent]))
    truth = json.loads((RECORDING / "truth.json").read_text())["parameters"]
    found = json.loads((options.demo / "run/summary.json").read_text())["parameters"]
    tuned = json.loads((options.demo / "tuned.json").read_text())["identification"]["estimate"]
    wrong = [name for name, finding in found.items()
             if finding["identifiable"] != "yes" or tuned[name] != finding["estimate"]
             or not finding["interval95"][0] <= truth[name] <= finding["interval95"][1]]
    if wrong or len(found) != 2:
        sys.exit(f"not told, or not as exported: {', '.join(wrong)}")
    replayed = subprocess.run([options.sysid, "replay", options.demo / "lift", "--asset", options.demo / "tuned.json", "--force",
                               "--json", "-o", options.demo / "check"], check=True, capture_output=True, text=True)
    score = json.loads(replayed.stdout)["score"]
    searched = json.loads((options.demo / "run/summary.json").read_text())["best"]["score_on_mesh"]
    # The asset has every digit of the estimate: what is left is rounding, as solved steps pass it on.
    if abs(score - searched) > 1e-4 * searched or "score is" in replayed.stderr:
        sys.exit(f"replay of tuned.json scores {score}, the search had {searched}: {replayed.stderr}")


if __name__ == "__main__":
    main()
