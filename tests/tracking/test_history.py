"""A history is written in parts, and as one file beside them."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from urdyn.io.run_folder import HISTORY, PARTS
from urdyn.tracking.output.history import FEW, History, Whole
from urdyn.tracking.output.history_parts import part_file
from urdyn.tracking.output.history_row import columns

NAMES = ("payload.mass",), ("kg",), 1


@pytest.fixture
def history(tmp_path):
    (tmp_path / PARTS).mkdir()
    return History(tmp_path, *NAMES)


def write(history, number):
    """A part of one row, at t = its number."""
    history.write(number, [np.r_[float(number), np.zeros(len(columns(*NAMES)) - 1)]])


def test_the_end_of_a_long_run_waits_for_its_last_parts_alone(history):
    whole = Whole(history, {})
    for number in range(30):
        write(history, number)
        whole.approach(number + 1)
        part_file(history.folder, number).unlink()  # nobody needs it to end
    write(history, 30)
    assert not (history.folder / HISTORY).exists()
    whole.finish(31)
    assert pq.read_table(history.folder / HISTORY)["t"].to_pylist() == [*map(float, range(31))]


def test_parts_of_a_run_that_goes_on_are_joined_a_few_at_a_time(history):
    for number in range(3 * FEW):
        write(history, number)
    whole = Whole(history, {})
    whole.approach(3 * FEW)
    part_file(history.folder, FEW - 1).unlink()
    whole.finish(3 * FEW)
    assert pq.read_table(history.folder / HISTORY).num_rows == 3 * FEW


def test_of_a_history_that_is_not_finished_parts_alone_are_left(history):
    whole = Whole(history, {})
    write(history, 0)
    whole.approach(1)
    whole.close()
    assert [path.name for path in history.folder.iterdir()] == [PARTS]
