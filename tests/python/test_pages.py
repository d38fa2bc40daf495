"""Pages whose blocks in Python are run, as they stand, from top to bottom."""
import os
import pathlib
import re
import subprocess
import sys

import pytest
from conftest import ROOT

BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.M | re.S)


@pytest.mark.parametrize("page", ["docs/how_to/own_objective.md"])
def test_blocks_run(page, tmp_path, monkeypatch):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    environment = {**os.environ, "PATH": f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"}
    names = {}
    blocks = BLOCK.findall((ROOT / page).read_text())
    assert {language for language, _ in blocks} == {"sh", "python"}
    for language, text in blocks:
        if language == "sh":
            subprocess.run(text, shell=True, check=True, env=environment)
        else:
            exec(compile(text, f"{page}", "exec"), names)
    assert names["bending"] == pytest.approx(1e-4, rel=0.1)  # the search ends within 5 %, and noise of 1 mm moves it less
    # The noise of 1 mm and 3,600 points: nothing that the model does not have. Values stand 0.5 % apart.
    assert names["mean"] == pytest.approx(1e-4, rel=0.02) and 1e-7 < names["spread"] < 2e-6
