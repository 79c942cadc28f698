"""The notebook in the docs runs from its first cell to its last, and shows what it says."""

import json

import pytest

from support.paths import DOCS
from support.processes.waiting import PATIENCE_S

NOTEBOOK = DOCS / "notebooks" / "first_look.ipynb"


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of Jupyter's own packages
def test_the_notebook_runs_and_shows_tables_and_pictures() -> None:
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    NotebookClient(notebook, timeout=PATIENCE_S, resources={"metadata": {"path": NOTEBOOK.parent}}).execute()
    shown = [output.get("data", {}) for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert sum("image/png" in data for data in shown) == 3
    assert sum(data.get("text/html", "").startswith("<table>") for data in shown) == 5
    assert sum("dataframe" in data.get("text/html", "") for data in shown) == 1
    assert any("verdict: pass" in data.get("text/html", "") for data in shown)
    said = str([cell.get("outputs") for cell in notebook.cells])
    assert all(words in said for words in ("wrong_unit: ", "°/s", "all within limits", "certificate.html"))


def test_no_output_is_kept_in_the_notebook() -> None:
    assert not any(cell.get("outputs") for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"])
