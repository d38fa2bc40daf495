#!/usr/bin/env python3
"""Each answer against Park's, Shah's and the plain bundle's, on views that took no part: ten interleaved parts of every
recorded set below a folder. In px, mm and deg stand the answer, the least of the others, whose it is, and by how many
standard errors of the difference over the parts the answer is worse (negative: better). What is worse by more than two
is marked.

    tests/validation/handeye_methods.py build/release/bin/flash-calib ../shared/data/handeye"""
import argparse
import json
import pathlib
import subprocess
import tempfile

OTHERS = ("park", "shah", "bundle")


def row(result, unit):
    methods = result["comparison"]
    answer = methods["errors_in_variables"][f"heldout_{unit}"]
    best = min(OTHERS, key=lambda name: methods[name][f"heldout_{unit}"])
    behind = methods[best]["behind"][unit]
    return f"{answer:7.3f} {methods[best][f'heldout_{unit}']:7.3f} {best:6} {behind:+5.1f}{' !' if behind > 2 else '  '}", behind > 2


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--cache", default="")
    options = parser.parse_args()
    worse = {"px": 0, "mm": 0, "deg": 0}
    print(f"{'set':32} " + " | ".join(f"{unit:>7} {'others':>7} {'whose':6} {'behind':>7}" for unit in worse))
    with tempfile.TemporaryDirectory() as folder:
        for target in sorted(options.data.glob("**/target.json")):
            out = pathlib.Path(folder) / "camera.json"
            out.unlink(missing_ok=True)
            cache = ["--cache", options.cache] if options.cache else []
            subprocess.run([options.program, "handeye", target.parent, *cache, "--quiet", "--force", "-o", out],
                           capture_output=True)
            result = json.loads(out.read_text()) if out.exists() else {"comparison": {}}
            name = str(target.parent.relative_to(options.data))
            if "errors_in_variables" not in result["comparison"]:
                continue
            cells = {unit: row(result, unit) for unit in worse}
            for unit, (_, marked) in cells.items():
                worse[unit] += marked
            print(f"{name:32} " + " | ".join(text for text, _ in cells.values()) +
                  (" lens not as stated" if not result["lens"]["as_stated"] else ""), flush=True)
    print("worse by more than two standard errors: " + ", ".join(f"{count} in {unit}" for unit, count in worse.items()))


if __name__ == "__main__":
    main()
