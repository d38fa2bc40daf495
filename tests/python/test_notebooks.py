"""Notebooks run as they stand, their answers hold the truth, and what they print and draw is kept for the site."""
import json
import textwrap
import warnings

import nbclient
import nbformat
import pytest
from conftest import ROOT

EXECUTED = ROOT / "build" / "notebooks"  # scripts/site_pages.py makes pages of them
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))

# By the names that a notebook leaves, beside what its cells assert.
HOLDS = {
    "identify_a_towel": """
        assert abs(answer.values["bending"] / 2e-4 - 1) < 0.1 and abs(answer.values["friction"] / 0.35 - 1) < 0.2
        assert all(high - low < 0.3 * truth[name] for name, (low, high) in answer.intervals.items())  # they say something
        assert tuned.verdicts == answer.verdicts and np.allclose(tuned.intervals["friction"], answer.intervals["friction"], rtol=1e-3)
        assert len(set(bending)) == 16 and abs(height[:, -1] - 120).max() < 2  # the hand has lifted each corner
        """,
    "calibrate_a_camera": """
        for one in (answer, solved, warned, wrist):
            assert abs(one.T[:3, 3] - X[:3, 3]).max() < 5e-3 and one.sd[:3].max() < 3e-3
        assert not stated.usable and abs(stated.T[:3, 3] - X[:3, 3]).max() > 10e-3  # exact, and wrong
        assert 4 < np.mean(far["repeatable"]) < 8  # of chi-square over 30 cells it is 6 +- 0.6
        assert np.mean(far["covariance"]) < np.mean(far["repeatable"])
        """}


def executed(notebook, folder):
    """With its outputs. CellExecutionError where a cell raises."""
    with warnings.catch_warnings():  # of the client: those of a cell are its outputs
        warnings.simplefilter("ignore")
        return nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()


@pytest.fixture(autouse=True)
def own_settings(tmp_path, monkeypatch):
    """The kernel is that of this Python, without what the user has set."""
    for name in ("JUPYTER_DATA_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR", "MPLCONFIGDIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    monkeypatch.delenv("MPLBACKEND", raising=False)
    (tmp_path / "here").mkdir()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_holds_the_truth(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    notebook.cells.append(nbformat.v4.new_code_cell(textwrap.dedent(HOLDS[path.stem])))
    done = executed(notebook, tmp_path / "here")
    del done.cells[-1]
    outputs = [output for cell in done.cells if cell.cell_type == "code" for output in cell.outputs]
    assert [output.text for output in outputs if output.get("name") == "stderr"] == []  # no warning that a reader would wonder at
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 4
    assert not any((tmp_path / "here").iterdir())
    EXECUTED.mkdir(parents=True, exist_ok=True)
    nbformat.write(done, EXECUTED / path.name)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(path):
    text = path.read_text(encoding="utf-8")
    file = json.loads(text)
    nbformat.validate(file)
    code = [cell for cell in file["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code) and len(code) <= 15
    assert text == json.dumps(file, indent=1, ensure_ascii=False) + "\n"  # as Jupyter lays it out, so that changes are small


def test_a_cell_that_raises_is_seen(tmp_path):
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("assert 1 == 2")])
    with pytest.raises(nbclient.exceptions.CellExecutionError, match="AssertionError"):
        executed(notebook, tmp_path / "here")
