"""One seed each of the studies of synthetic.py: truth found, verdicts right, and the same whatever `kind` says."""
import argparse
import pathlib
import shutil

import synthetic
from runs import Runs

SEED = 141


def check(what, value, good):
    print(f"{'ok    ' if good else 'WRONG '} {what}: {value}")
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder of its own")
    options = parser.parse_args()
    shutil.rmtree(options.out, ignore_errors=True)
    runs = Runs(options.sysid, options.out)

    bending = 1e-4
    _, allowed, _, _ = synthetic.BENDING[bending]
    lifted = synthetic.lift(runs, bending, SEED)
    relabelled = synthetic.lift(runs, bending, SEED, "free")
    pulled = synthetic.bar_pull(runs, SEED)["parameters"]
    D = lifted["parameters"]["bending"]["estimate"]
    young, poisson = pulled["young"], pulled["poisson"]
    results = [
        check("lift: D [N m]", D, abs(D / bending - 1) <= allowed),
        check("lift: verdicts", synthetic.verdicts(lifted), synthetic.verdicts(lifted) == {"poisson": "no", "bending": "yes"}),
        check("lift called `free`: verdicts", synthetic.verdicts(relabelled),
              synthetic.verdicts(relabelled) == synthetic.verdicts(lifted)),
        check("bar pull: E t [N/m]", young["estimate"], abs(young["estimate"] / synthetic.BAR_MATERIAL["young"] - 1) <= 0.03),
        check("bar pull: nu", poisson["estimate"], abs(poisson["estimate"] - synthetic.BAR_MATERIAL["poisson"]) <= 0.03),
        check("bar pull: verdicts", (young["identifiable"], poisson["identifiable"]),
              young["identifiable"] == poisson["identifiable"] == "yes")]
    return 0 if all(results) else 1


if __name__ == "__main__":
    raise SystemExit(main())
