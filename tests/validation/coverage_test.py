#!/usr/bin/env python3
"""The coverage study answers each twin in the ways that are asked for, goes on where it stopped, and tells both. A program that
writes what it was asked stands in for flash-sysid."""
import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

try:
    import coverage
except ModuleNotFoundError as missing:  # a package of validation
    print(f"skipped: {missing.name}")
    sys.exit(0)

PROGRAM = f"""#!{sys.executable}
import json, pathlib, sys
words = sys.argv[1:]
out = pathlib.Path(words[words.index("-o") + 1])
out.mkdir(parents=True, exist_ok=True)
with open(out.parent / "calls", "a") as calls:
    calls.write(out.name + chr(10))
if words[0] == "synth":
    (out / "recording.json").write_text(json.dumps({{"nuisance": {{}}, "keyframes": []}}))
elif (out.parent / "fails").exists() and "sampling" in words:
    sys.exit(2)
else:
    width = 2 if "sampling" in words else 3
    found = {{"identifiable": "yes", "estimate": 60, "interval95": [60 / width, 60 * width]}}
    parameters = {{name: found for name in ("young", "poisson")}}
    parameters["poisson"] = found | {{"estimate": 0.2, "interval95": [0.25 - width / 10, 0.25 + width / 10]}}
    (out / "results.csv").write_text("score_m\\n0.001\\n")
    (out / "summary.json").write_text(json.dumps(
        {{"parameters": parameters, "wall_seconds": 7.0, "recordings": [{{"noise_m": 0.001, "model_fits": True}}]}}))
"""


class Coverage(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = pathlib.Path(folder.name) / "out"
        self.program = pathlib.Path(folder.name) / "flash-sysid"
        self.program.write_text(PROGRAM)
        self.program.chmod(0o755)

    def study(self, *more):
        """What it prints, and the searches that it ran."""
        calls = self.out / "calls"
        calls.unlink(missing_ok=True)
        printed = io.StringIO()
        words = ["coverage.py", "--sysid", str(self.program), "--out", str(self.out), "--kind", "bar_pull", "--seed", "5", "--runs", "2", *more]
        with mock.patch.object(sys, "argv", words), contextlib.redirect_stdout(printed):
            self.assertEqual(coverage.main(), 0)
        names = calls.read_text().split() if calls.exists() else []
        return printed.getvalue(), sorted(name for name in names if name.startswith("run_"))

    def test_each_twin_is_answered_in_both_ways_once(self):
        printed, ran = self.study("--also", "sampled")
        twins = ["run_5_damping", "run_5_right", "run_6_right", "run_6_weight"]
        self.assertEqual(ran, sorted(twins + [f"{name}_sampled" for name in twins]))
        self.assertIn("Answered again: sampled, 4 of 4", printed)
        self.assertIn("0.6000 | 0.4000", printed)  # widths of Poisson's ratio
        self.assertEqual(self.study("--also", "sampled"), (printed[printed.index("\nbar_pull"):], []))

    def test_a_study_of_one_way_goes_on_with_the_other(self):
        _, ran = self.study()
        self.assertEqual(len(ran), 4)
        _, ran = self.study("--also", "sampled")
        self.assertEqual(ran, ["run_5_damping_sampled", "run_5_right_sampled", "run_6_right_sampled", "run_6_weight_sampled"])

    def test_where_the_other_way_was_not_done_in_time_or_fails_the_first_counts(self):
        self.study("--runs", "1")
        printed, ran = self.study("--also", "sampled", "--minutes", "0")
        self.assertEqual(ran, ["run_5_right_sampled"])  # the first search of sheets of one size is always run
        self.assertIn("2 of 4 searched", printed)
        self.assertIn("Answered again: sampled, 1 of 2", printed)
        (self.out / "fails").touch()
        printed, _ = self.study("--also", "sampled")
        self.assertIn("4 of 4 searched", printed)
        self.assertIn("Answered again: sampled, 1 of 4", printed)

    def test_rows_of_earlier_calls_keep_both_answers(self):
        self.study("--also", "sampled")
        rows = self.out / "coverage.json"
        kept = rows.rename(self.out / "earlier.json")
        printed, ran = self.study("--also", "sampled", "--rows", str(kept))
        self.assertEqual(ran, [])
        self.assertIn("Answered again: sampled, 4 of 4", printed)
        self.assertEqual(json.loads(rows.read_text()), json.loads(kept.read_text()))


if __name__ == "__main__":
    unittest.main()
