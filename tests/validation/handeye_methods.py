#!/usr/bin/env python3
"""Each answer against Park's, Shah's, the plain bundle's and another errors in variables' (handeye_peer.py), for every
recorded set below a folder, or for drawn cells (drawn_cells). Each use is asked for what it is for: image for pixels, workspace
for mm and deg, each on views that took no part (ten parts, drawn at random); two-arms for how far ten splits into
halves, taken for two arms on one camera, put the middle of the workspace from each other. Beside the answer stand the least of
the others, whose it is, and by how much the answer is worse (negative: better), with the standard error of the
difference: that of the paired difference of squares over parts or splits, over the sum of both rms. What is worse by more
than two of them is marked. Halves are of recorded sets with 16 views or more.

    tests/validation/handeye_methods.py --program build/release/bin/flash-calib ../shared/data/handeye
    build/release/tests/drawn_cells cells 40 8100001 1; tests/validation/handeye_methods.py --drawn cells"""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile

import numpy

import handeye_peer as peer

OTHERS = ("park", "shah", "bundle", "peer")
USES = ("workspace", "image", "two-arms")
MEASURES = {"px": "image", "mm": "workspace", "deg": "workspace", "two arms mm": "two-arms"}
# Of Student's t with nine degrees of freedom, beyond two standard errors: how often equals are called worse.
CHANCE = 0.038


class Set:
    """One recording, solved for every use. answers: by use; detections: of its corners."""

    def __init__(self, answers, detections, halves):
        self.answers = answers
        as_stated = answers["two-arms"]
        views = peer.Views(as_stated, detections, as_stated["lens"])
        park = as_stated["comparison"]["park"]
        X = peer.pose(park["translation"] + park["rotation_xyzw"])
        self.peer_folds, self.peer_rms = peer.held_out(views, X, as_stated["residuals"]["heldout_part"])
        self.first_halves = as_stated["use"].get("first_halves") if halves else None
        if self.first_halves and len(self.first_halves[0]) < 8:
            self.first_halves = None
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


def recorded(program, dataset, cache, seed):
    """None where a use is refused, or nothing is told of the target's size."""
    with tempfile.TemporaryDirectory() as folder:
        def run(verb, *command):
            out = pathlib.Path(folder) / "out.json"
            out.unlink(missing_ok=True)
            subprocess.run([program, verb, dataset, *command, "--cache", cache, "--quiet", "--force", "-o", out],
                           capture_output=True)
            return json.loads(out.read_text()) if out.exists() else None
        answers = {use: run("handeye", "--for", use, "--held-out-seed", str(seed)) for use in USES}
        if not all(answer and answer["scale"] for answer in answers.values()):
            return None
        return Set(answers, run("detect"), halves=True)


def drawn(folder):
    return Set({use: json.loads((folder / f"{use}.json").read_text()) for use in USES}, json.loads((folder / "detect.json").read_text()),
               halves=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--program", help="flash-calib, which solves the recorded sets")
    parser.add_argument("--drawn", action="store_true", help="DATA is what drawn_cells wrote")
    parser.add_argument("--cache", help="folder that keeps corners found")
    parser.add_argument("--seed", type=int, default=1, help="by which views left out are drawn; 0: interleaved")
    options = parser.parse_args()
    worse, compared = dict.fromkeys(MEASURES, 0), dict.fromkeys(MEASURES, 0)
    ratios = {measure: [] for measure in MEASURES}
    halves = {name: [] for name in (None, *OTHERS)}
    print(f"{'set':28} " + " | ".join(f"{unit:>11} {'others':>7} {'whose':6} {'behind':>7}    {'s.e.':>5}  " for unit in MEASURES))
    with tempfile.TemporaryDirectory() as cache:
        for file in sorted(options.data.glob("**/detect.json" if options.drawn else "**/target.json")):
            one = drawn(file.parent) if options.drawn else recorded(options.program, file.parent, options.cache or cache, options.seed)
            if one is None:
                continue
            cells = []
            for measure in MEASURES:
                if measure == "two arms mm" and not one.first_halves:
                    continue
                answer, least, best, behind, error = one.row(measure)
                compared[measure] += 1
                worse[measure] += behind > 2 * error
                ratios[measure].append(answer / least)
                mark = " !" if behind > 2 * error else "  "
                cells.append(f"{answer:11.3f} {least:7.3f} {best:6} {behind:+7.3f} +- {error:5.3f}{mark}")
                for name, squares in halves.items() if measure == "two arms mm" else ():
                    squares.append(one.squares(measure, name)[0])
            print(f"{file.parent.relative_to(options.data)!s:28} " + " | ".join(cells), flush=True)
    print("worse by more than two standard errors: " + ", ".join(
        f"{worse[unit]} of {count} in {unit}" for unit, count in compared.items() if count) + f"; of equals {100 * CHANCE:.1f} % would be")
    print("over the least of the others, median: " + ", ".join(f"{unit} {numpy.median(each):.3f}" for unit, each in ratios.items() if each))
    if halves[None]:
        print("two arms, rms over all sets: " + ", ".join(
            f"{name or 'answer'} {math.sqrt(numpy.mean(squares)):.2f} mm" for name, squares in halves.items()))


if __name__ == "__main__":
    main()
