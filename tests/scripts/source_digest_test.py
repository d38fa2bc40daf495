#!/usr/bin/env python3
"""cmake/SourceDigest.cmake: the same names and contents have the same digest in any folder, others another. Usage:
source_digest_test.py --cmake CMAKE"""
import argparse
import hashlib
import pathlib
import re
import subprocess
import tempfile

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "cmake" / "SourceDigest.cmake"
TREE = {"sim/step.h": "int step();\n", "sim/cuda/step.cu": "int step() { return 1; }\n", "replay/run.cpp": "run\n"}


def digest(cmake, files):
    with tempfile.TemporaryDirectory() as root:
        for name, text in files.items():
            path = pathlib.Path(root, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        output = pathlib.Path(root, "digest.cpp")
        subprocess.run([cmake, f"-DROOT={root}", "-DFOLDERS=sim;replay", "-DSYMBOL=motions", f"-DOUTPUT={output}", "-P", SCRIPT],
                       check=True)
        return re.search(r'motions\(\) { return "([0-9a-f]{64})"', output.read_text())[1]


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--cmake", required=True)
    cmake = parser.parse_args().cmake
    here = digest(cmake, TREE)
    expected = sha256("".join(f"{sha256(TREE[name])} {name}\n" for name in ("sim/cuda/step.cu", "sim/step.h", "replay/run.cpp")))
    assert here == expected, (here, expected)
    assert here == digest(cmake, TREE), "another folder"
    assert here == digest(cmake, TREE | {"sim/notes.md": "no source\n", "apps/main.cpp": "elsewhere\n"})
    changed = [TREE | {"sim/step.h": "int  step();\n"}, TREE | {"sim/new.h": ""},
               {name: text for name, text in TREE.items() if name != "replay/run.cpp"},
               {name.replace("step.h", "stride.h"): text for name, text in TREE.items()}]
    digests = [digest(cmake, tree) for tree in changed]
    assert len({here, *digests}) == len(changed) + 1, "a change that is not seen"


if __name__ == "__main__":
    main()
