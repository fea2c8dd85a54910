"""The notebooks of examples/: what is committed of each, that it runs, and that its text is true.

What a cell has to give is in `notebooks/`, under the name of the cell, and is run after it. A
reader, who changes numbers, meets no assertion.
"""

import json
import re
from pathlib import Path
from textwrap import indent

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))
MARKED = "# Change these numbers: all that follows is computed from them."
OTHERS = (  # two other sets of numbers of the last notebook
    {"(0.061,": "(0.110,", "(0.030,": "(0.040,", "turns = 20": "turns = 12", "= 15": "= 8"},
    {"turns = 20": "turns = 35", "= 15": "= 25", "(240, 30)": "(120, 25)", "(0.025": "(0.035"},
)
PYTHON = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}

each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def checks(path):
    """Return by the name of a cell what is to hold after it."""
    text = (Path(__file__).parent / "notebooks" / f"{path.stem}.py").read_text("utf-8")
    _, *parts = re.split(r"^# %% (\S+)\n", text, flags=re.MULTILINE)
    return dict(zip(parts[::2], parts[1::2], strict=True))


@each_notebook
def test_a_notebook_is_committed_without_what_it_printed(path):
    document = json.loads(path.read_text("utf-8"))
    assert document["metadata"] == PYTHON
    assert len({cell["id"] for cell in document["cells"]}) == len(document["cells"]) <= 40
    for cell in document["cells"]:
        assert (cell["metadata"], cell.get("outputs", [])) == ({}, [])
        assert cell.get("execution_count") is None


@each_notebook
def test_the_solutions_of_a_notebook_are_held_to_and_its_links_lead_somewhere(path):
    document, held = json.loads(path.read_text("utf-8")), checks(path)
    names = [cell["id"] for cell in document["cells"]]
    texts = ["".join(cell["source"]) for cell in document["cells"]]
    assert {*held} <= {*names}
    [start] = [i for i, text in enumerate(texts) if "### Solutions" in text]
    assert sum(held.get(name, "").count("assert ") for name in names[start:]) >= 3
    for link in re.findall(r"\]\(([^)#]+)", "\n".join(texts)):
        assert link.startswith("https://") or (EXAMPLES / link).exists(), link


def run(notebook, folder, monkeypatch):
    """Run all cells of a notebook."""
    nbclient = pytest.importorskip("nbclient", reason="it comes with the extra docs")
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "MPLCONFIGDIR"):
        monkeypatch.setenv(name, str(folder / name))
    how = {"timeout": 120, "resources": {"metadata": {"path": str(folder)}}}
    nbclient.NotebookClient(notebook, kernel_name="python3", **how).execute()


@pytest.mark.slow
@pytest.mark.processes
@each_notebook
def test_a_notebook_runs_and_does_what_its_text_says(path, tmp_path, monkeypatch):
    nbformat = pytest.importorskip("nbformat", reason="it comes with the extra docs")
    notebook, held = nbformat.read(path, as_version=4), checks(path)
    for place in reversed(range(len(notebook.cells))):
        if code := held.get(notebook.cells[place].id):  # in a function, which leaves no names
            code = f"def check():\n{indent(code, '    ')}\n\ncheck()"
            notebook.cells.insert(place + 1, nbformat.v4.new_code_cell(code))
    run(notebook, tmp_path, monkeypatch)
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            assert output.get("name") != "stderr", output["text"]


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize("changed", OTHERS)
def test_a_notebook_runs_with_other_numbers(changed, tmp_path, monkeypatch):
    nbformat = pytest.importorskip("nbformat", reason="it comes with the extra docs")
    notebook = nbformat.read(NOTEBOOKS[-1], as_version=4)
    [marked] = [cell for cell in notebook.cells if cell.source.startswith(MARKED)]
    for old, new in changed.items():
        assert old in marked.source
        marked.source = marked.source.replace(old, new)
    run(notebook, tmp_path, monkeypatch)
