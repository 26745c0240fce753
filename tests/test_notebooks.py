"""Every notebook runs from top to bottom, as a reader would run it, and is fit to be looked at."""

import ast
import importlib
import json
import os
import re
from pathlib import Path

import pytest

import urdyn

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
EVERY = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
MACHINE = re.compile(r"(?<![\w.:/])/(tmp|work|root|home|usr|opt|var|Users|private)/|[A-Z]:\\\\")
TROUBLE = re.compile(r"Warning\b|Traceback \(most recent call last\)|\x1b\[")


def cells(path, kind):
    """Cells of a notebook of one kind, as saved."""
    return [c for c in json.loads(path.read_text())["cells"] if c["cell_type"] == kind]


RUN = [
    # Campaigns of many lives, and searches.
    pytest.param(path, marks=pytest.mark.slow)
    if path.stem in ("03_filters", "04_drift", "05_faults", "06_kinematics", "07_your_robot")
    else path
    for path in NOTEBOOKS
]


@pytest.mark.parametrize("path", RUN, ids=[path.stem for path in NOTEBOOKS])
@pytest.mark.filterwarnings("ignore")
def test_notebook_runs(path, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(path, as_version=4)
    where, saved = {"metadata": {"path": str(tmp_path)}}, errors(notebook)
    nbclient.NotebookClient(notebook, timeout=240, resources=where).execute()
    if "URDYN_RECORDINGS" in os.environ:  # which saved notebooks are of
        assert errors(notebook) == pytest.approx(saved, abs=0.11)  # one of the last digit
    assert bool(saved) == (path.stem == "01_identify")  # the one that has such a table


def errors(notebook):
    """Those of predicted currents, and their floors, as a notebook's tables have them [%]."""
    told = "".join(o.get("text", "") for c in notebook.cells for o in c.get("outputs", ()))
    rows = [row for row in told.splitlines() if "above 10 Hz" in row]
    return [float(value) for row in rows for value in re.findall(r"\d+\.\d", row)]


def test_notebooks_are_numbered_from_one():
    assert [path.stem[:2] for path in NOTEBOOKS] == [f"{k:02d}" for k in range(1, 8)]


@EVERY
def test_notebook_is_saved_as_it_ran_with_pictures(path):
    code = cells(path, "code")
    assert [c["execution_count"] for c in code] == list(range(1, len(code) + 1))
    outputs = [o for c in code for o in c["outputs"]]
    assert any("image/png" in o.get("data", {}) for o in outputs)
    assert {o["output_type"] for o in outputs} <= {"stream", "display_data"}
    assert all(o["name"] == "stdout" for o in outputs if o["output_type"] == "stream")


@EVERY
def test_notebook_shows_neither_a_path_of_a_machine_nor_a_warning(path):
    for text in words(path):
        assert not MACHINE.search(text), text
        assert not TROUBLE.search(text), text


def words(path):
    """All that a reader can read of a notebook."""
    for cell in cells(path, "markdown") + cells(path, "code"):
        yield "".join(cell["source"])
        for output in cell.get("outputs", ()):
            yield "".join(output.get("text", ""))
            for kind, data in output.get("data", {}).items():
                if kind.startswith("text/"):
                    yield "".join(data)


@EVERY
def test_notebook_uses_public_names_only(path):
    tree = ast.parse("\n".join("".join(c["source"]) for c in cells(path, "code")))
    assert not list(private(tree))


def private(tree):
    """What a notebook takes of urdyn that no `__all__` lists, and names that begin with _."""
    rooms = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            rooms |= {a.asname or a.name: a.name for a in node.names if a.name.startswith("urdyn")}
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("urdyn"):
            listed = importlib.import_module(node.module).__all__ if public(node.module) else ()
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                if public(whole):
                    rooms[alias.asname or alias.name] = whole
                elif alias.name not in listed:
                    yield whole
    for node in ast.walk(tree):
        if not isinstance(node, ast.Attribute):
            continue
        owner = rooms.get(node.value.id) if isinstance(node.value, ast.Name) else None
        if owner and node.attr not in importlib.import_module(owner).__all__:
            yield f"{owner}.{node.attr}"
        elif node.attr.startswith("_"):
            yield node.attr


def public(name):
    """Is this a room that says what it exports?"""
    try:
        return hasattr(importlib.import_module(name), "__all__")
    except ModuleNotFoundError:
        return False


@pytest.mark.parametrize(
    "source",
    [
        "from urdyn.dbn.graph import Network",
        "from urdyn.dbn import Widening",
        "import urdyn as ud\nud.lookup",
        "import urdyn as ud\nud.Twin._x",
        "from urdyn import bench\nbench.arm",
    ],
)
def test_a_private_name_would_be_noticed(source):
    assert list(private(ast.parse(source)))


def test_every_public_name_of_the_package_is_there():
    assert all(hasattr(urdyn, name) for name in urdyn.__all__)
