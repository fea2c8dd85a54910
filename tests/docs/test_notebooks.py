"""The notebooks of examples/: what is committed of each, and that it runs from top to bottom."""

import json
import re
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))
MOST_CELLS = 40
PYTHON = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
TIME_LIMIT_S = 120  # of a cell

each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def cells(path):
    """Return the kind and the text of each cell."""
    document = json.loads(path.read_text("utf-8"))
    return [(cell["cell_type"], "".join(cell["source"])) for cell in document["cells"]]


def test_there_are_notebooks():
    assert NOTEBOOKS


@each_notebook
def test_a_notebook_is_committed_without_what_it_printed(path):
    document = json.loads(path.read_text("utf-8"))
    assert document["metadata"] == PYTHON
    assert len(document["cells"]) <= MOST_CELLS
    assert len({cell["id"] for cell in document["cells"]}) == len(document["cells"])
    for cell in document["cells"]:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
        assert not cell["metadata"]


@each_notebook
def test_a_notebook_ends_with_exercises_and_their_solutions(path):
    text = "\n\n".join(text for kind, text in cells(path) if kind == "markdown")
    title, *_ = text.splitlines()
    assert title.startswith("# ")
    *_, last = re.split(r"^## +", text, flags=re.MULTILINE)
    assert last.startswith("Exercises\n")
    asked, solved = re.split(r"^### +Solutions$", last, flags=re.MULTILINE)
    numbers = ["".join(re.findall(r"^(?:\*\*)?(\d)[.)]", part, re.M)) for part in (asked, solved)]
    assert numbers in (["123"] * 2, ["1234"] * 2)


@each_notebook
def test_the_solutions_of_a_notebook_are_held_to(path):
    found = cells(path)
    [start] = [i for i, (_, text) in enumerate(found) if re.search(r"^### +Solutions$", text, re.M)]
    assert sum(text.count("assert ") for kind, text in found[start:] if kind == "code") >= 3


@each_notebook
def test_the_links_of_a_notebook_lead_somewhere(path):
    text = "\n".join(text for _, text in cells(path))
    for link in re.findall(r"\]\(([^)#]+)", text):
        assert link.startswith("https://") or (EXAMPLES / link).exists(), link


@pytest.mark.slow
@pytest.mark.processes
@each_notebook
def test_a_notebook_runs_from_top_to_bottom(path, tmp_path, monkeypatch):
    nbformat = pytest.importorskip("nbformat", reason="it comes with the extra docs")
    nbclient = pytest.importorskip("nbclient", reason="it comes with the extra docs")
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "MPLCONFIGDIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    notebook = nbformat.read(path, as_version=4)
    where = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(
        notebook, timeout=TIME_LIMIT_S, kernel_name="python3", resources=where
    ).execute()
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            assert output.get("name") != "stderr", output["text"]
