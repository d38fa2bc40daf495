#!/usr/bin/env python3
"""A reference scene that has no result is named and fails the run; the scenes after it are run all the same."""
import contextlib
import io
import pathlib
import tempfile

import run


def solve(name, *_):
    if name == "b":
        raise KeyError("velocity after one step")
    return name, 0.1, ""


with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as printed:
    run.solve, run.reference.rows_of = solve, lambda *_: []
    try:
        run.main(["--sim", "none", "--scenes", folder, "--out", str(pathlib.Path(folder) / "out"), "a", "b", "c"])
    except SystemExit as end:
        code = end.code
text = printed.getvalue()
assert code == 1, code
assert "b  no result: KeyError: 'velocity after one step'" in text, text
assert "s  a" in text and "s  c" in text, text
