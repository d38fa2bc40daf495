#!/usr/bin/env python3
"""Each answer against Park's, Shah's, the plain bundle's and another errors in variables' (handeye_peer.py), for every
recorded set below a folder. Each use is asked for what it is for: image for pixels, workspace for mm and deg, each on
views that took no part (ten interleaved parts); two-arms for how far ten splits into halves, taken for two arms on one
camera, put the middle of the workspace from each other. Beside the answer stand the least of the others, whose it is, and
by how much the answer is worse (negative: better), with the standard error of the difference: that of the paired
difference of squares over parts or splits, over the sum of both rms. What is worse by more than two of them is marked.
Halves are of sets with 16 views or more.

    tests/validation/handeye_methods.py build/release/bin/flash-calib ../shared/data/handeye"""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile

import numpy

import handeye_peer as peer

OTHERS = ("park", "shah", "bundle", "peer")
MEASURES = {"px": "image", "mm": "workspace", "deg": "workspace", "two arms mm": "two-arms"}


class Set:
    """One dataset, solved for every use."""

    def __init__(self, program, dataset, cache, folder):
        def run(verb, *command):
            out = folder / "out.json"
            out.unlink(missing_ok=True)
            subprocess.run([program, verb, dataset, *command, "--cache", cache, "--quiet", "--force", "-o", out],
                           capture_output=True)
            return json.loads(out.read_text()) if out.exists() else None
        self.answers = {use: run("handeye", "--for", use) for use in ("workspace", "image", "two-arms")}
        self.complete = all(answer and answer["scale"] for answer in self.answers.values())
        if not self.complete:
            return
        as_stated = self.answers["two-arms"]
        views = peer.Views(as_stated, run("detect"), as_stated["lens"])
        park = as_stated["comparison"]["park"]
        X = peer.pose(park["translation"] + park["rotation_xyzw"])
        self.peer_folds, self.peer_rms = peer.held_out(views, X)
        self.first_halves = as_stated["use"].get("first_halves")
        self.peer_apart = peer.halves_apart(views, X, self.first_halves) if self.first_halves else None

    def squares(self, measure, method):
        """Of the answer (None) or another method: squared errors by part or split, and their rms over all views."""
        result = self.answers[MEASURES[measure]]
        entry = result["comparison"].get(method or list(result["comparison"])[-1])
        if measure == "two arms mm":
            apart = self.peer_apart if method == "peer" else entry["halves_apart_mm"]
            each = [x * x for x in apart]
            return each, math.sqrt(sum(each) / len(each))
        column = ("px", "mm", "deg").index(measure)
        if method == "peer":
            return list(self.peer_folds[:, column]), self.peer_rms[column]
        return entry["heldout_folds"][column], entry[f"heldout_{measure}"]

    def row(self, measure):
        """Answer, the best of the others, whose it is, by how much the answer is worse, the standard error of that."""
        each, answer = self.squares(measure, None)
        best = min(OTHERS, key=lambda name: self.squares(measure, name)[1])
        others, least = self.squares(measure, best)
        difference = (numpy.array(each) - numpy.array(others)) / (answer + least)
        return answer, least, best, difference.mean(), difference.std(ddof=1) / math.sqrt(len(difference))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--cache", help="folder that keeps corners found")
    options = parser.parse_args()
    worse = dict.fromkeys(MEASURES, 0)
    halves = {name: [] for name in (None, *OTHERS)}
    print(f"{'set':28} " + " | ".join(f"{unit:>11} {'others':>7} {'whose':6} {'behind':>7}    {'s.e.':>5}  " for unit in MEASURES))
    with tempfile.TemporaryDirectory() as folder:
        for target in sorted(options.data.glob("**/target.json")):
            one = Set(options.program, target.parent, options.cache or folder, pathlib.Path(folder))
            if not one.complete:
                continue
            cells = []
            for measure in MEASURES:
                if measure == "two arms mm" and not (one.first_halves and len(one.first_halves[0]) >= 8):
                    continue
                answer, least, best, behind, error = one.row(measure)
                worse[measure] += behind > 2 * error
                mark = " !" if behind > 2 * error else "  "
                cells.append(f"{answer:11.3f} {least:7.3f} {best:6} {behind:+7.3f} +- {error:5.3f}{mark}")
                for name, squares in halves.items() if measure == "two arms mm" else ():
                    squares.append(one.squares(measure, name)[0])
            print(f"{target.parent.relative_to(options.data)!s:28} " + " | ".join(cells), flush=True)
    print("worse by more than two standard errors: " + ", ".join(f"{count} in {unit}" for unit, count in worse.items()))
    print("two arms, rms over all sets: " + ", ".join(
        f"{name or 'answer'} {math.sqrt(numpy.mean(squares)):.2f} mm" for name, squares in halves.items()))


if __name__ == "__main__":
    main()
