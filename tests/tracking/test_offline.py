"""A recording tracked in one call, without files."""

from dataclasses import replace

import numpy as np
import pytest
from workshop import rows

import urdyn as ud
from urdyn.errors import LogError
from urdyn.estimate import EKF
from urdyn.tracking import open_source


def test_it_goes_where_the_history_of_a_run_does(workshop, tmp_path):
    done = workshop.track(tmp_path, open_source(str(workshop.recording), rows=(0, 500)))
    table, went = rows(tmp_path), ud.track(workshop.fit, workshop.log.slice(0, 500), EKF())
    assert np.array_equal(went.t, table["t"].to_numpy())
    for k, name in enumerate(went.names):  # a history's numbers are no finer than they are known
        sd = went.sd[:, k]
        assert (np.abs(went[name] - table[name].to_numpy()) <= sd / 100.0).all(), name
        assert np.allclose(sd, table[f"{name}.sd"].to_numpy(), rtol=0.01), name
    assert np.allclose([i.nis for i in went.innovations], table["nis"].to_numpy())
    assert went.quantities == done["quantities"]


def test_a_slow_recording_of_angles_alone_is_tracked(workshop):
    rows = slice(0, 600, 4)
    channels = {n: x[rows] for n, x in workshop.log.channels.items() if n != "actual_qd"}
    log = replace(workshop.log, t=workshop.log.t[rows], channels=channels)
    went = ud.track(workshop.fit, log, EKF())
    assert went.t[-1] > log.t[-1] - 0.5


def test_what_is_no_log_of_the_arm_is_told(workshop):
    log = workshop.log
    with pytest.raises(LogError, match="too short"):
        ud.track(workshop.fit, log.slice(0, 3))
    with pytest.raises(LogError, match="one row only"):
        ud.track(workshop.fit, log.slice(0, 1))
    milli = log.channels | {"actual_current": 1e3 * log.joint("actual_current")}
    with pytest.raises(LogError, match="is it mA"):
        ud.track(workshop.fit, replace(log, channels=milli))
    with pytest.raises(LogError, match="actual_current"):
        bare = {name: of for name, of in log.channels.items() if name != "actual_current"}
        ud.track(workshop.fit, replace(log, channels=bare))
