#!/usr/bin/env python3
"""The coverage study credits no program for what it does not claim."""
import unittest

import synthetic
import tables

TRUTH = {"young": 10, "bending": 2e-4, "friction": 0.3}
AROUND = {name: [0.5 * value, 2 * value] for name, value in TRUTH.items()}
BESIDE = {name: [2 * value, 3 * value] for name, value in TRUTH.items()}


def twins(verdict, intervals, count):
    return [{"truth": TRUTH, "parameters": {name: {"identifiable": verdict, "interval95": intervals[name], "estimate": 1.1 * value}
                                            for name, value in TRUTH.items()}} for _ in range(count)]


class Coverage(unittest.TestCase):
    def test_a_program_that_always_says_no_has_nothing_that_holds(self):
        for row in synthetic.coverage_rows(twins("no", AROUND, 5)):
            self.assertEqual((row["twins"], row["claims"], row["held"]), (5, 0, 0))
        table = tables.synthetic_tables([], synthetic.coverage_rows(twins("no", AROUND, 5)))["coverage"]
        self.assertIn("| young | 5 | 0 | 0 | - | - | 10 |", table)

    def test_claims_that_hold_are_a_share_of_the_claims(self):
        # A bound from above at three times the truth holds, one from below at twice does not.
        found = (twins("yes", AROUND, 3) + twins("yes", BESIDE, 1) + twins("no", BESIDE, 4) +
                 twins("upper_bound", BESIDE, 2) + twins("lower_bound", BESIDE, 1))
        for row in synthetic.coverage_rows(found):
            self.assertEqual((row["twins"], row["claims"], row["one_sided"], row["held"]), (11, 7, 3, 5))
        table = tables.synthetic_tables([], synthetic.coverage_rows(found))["coverage"]
        self.assertIn("| bending | 11 | 7 | 3 | 5, 71 % | 2.00 | 10 |", table)


if __name__ == "__main__":
    unittest.main()
