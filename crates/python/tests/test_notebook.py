"""The notebook of examples/python: it runs from its first cell to its last, shows what it says, and is stored without outputs."""

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).resolve().parents[3] / "examples/python/first_quarter.ipynb"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Any:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    folder = tmp_path_factory.mktemp("notebook")
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()
    assert list(folder.iterdir()) == [], "it writes no file"
    return notebook


def texts(notebook: Any) -> str:
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    return "\n".join(output.get("text", "") + output.get("data", {}).get("text/plain", "") for output in outputs)


def test_law_the_notebook_runs_and_shows_three_pictures_and_two_tables(run: Any) -> None:
    outputs = [output for cell in run.cells if cell.cell_type == "code" for output in cell.outputs]
    assert [output.name for output in outputs if output.output_type == "stream" and output.name == "stderr"] == []
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    tables = [output for output in outputs if "text/html" in output.get("data", {})]
    assert (len(pictures), len(tables)) == (3, 2)
    assert all(len(output.data["image/png"]) > 10_000 for output in pictures)


def test_law_its_numbers_are_those_of_its_method(run: Any) -> None:
    said = texts(run)
    assert "suited - " in said and "trials 2000" in said, said
    for method in ("line-inductance-fast", "bipolar", "maximum-likelihood", "hfi-rotating"):
        assert method in said
    # Its own method is exact but for harmonics that saturation makes: some degrees, and not tens.
    own = float(said.split("rms error of the axis: ")[1].split("°")[0])
    assert 0.5 < own < 5.0, own


def test_law_the_notebook_is_stored_without_outputs() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(cells) >= 8
    assert all(cell.outputs == [] and cell.execution_count is None for cell in cells)
