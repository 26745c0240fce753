"""Every notebook runs from top to bottom, as a reader would run it."""

from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore")
def test_notebook_runs(path, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(path, as_version=4)
    where = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=90, resources=where).execute()


def test_notebooks_are_saved_with_their_outputs():
    for path in NOTEBOOKS:
        text = path.read_text()
        assert '"outputs": [\n    {' in text or '"outputs": [\n   {' in text, path.name
