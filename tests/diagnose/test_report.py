"""From a log to a page in three calls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from realarm import with_current

import urdyn as ud
from urdyn.diagnose.findings.doubt import ITS_TWIN
from urdyn.errors import InputError
from urdyn.estimate import EKF
from urdyn.io.run_folder import quiet


def test_a_track_is_diagnosed_and_its_page_says_the_same(shop, ur5e, tmp_path):
    twin = ud.Twin(ur5e, shop.fit)
    log = shop.log("sensor_fault:joint=2,onset=3,mode=stuck", seconds=6.0)
    track = ud.track(twin, log)
    report = ud.diagnose(track)
    (finding,) = report
    assert (finding.kind, finding.joint) == ("sensor_fault", 2)
    assert str(report) == str(ud.diagnose(twin, log)) == str(ud.diagnose(shop.fit, log))
    report.save(tmp_path / "monday.html")
    page = (tmp_path / "monday.html").read_text()
    assert "Elbow: sensor" in page and "Nothing wrong" not in page
    assert [path.name for path in tmp_path.iterdir()] == ["monday.html"]
    with pytest.raises(InputError, match="by itself"):
        ud.diagnose(track, log)
    with pytest.raises(InputError, match="with a log"):
        ud.diagnose(twin)


def test_where_no_arm_explained_what_was_tracked_its_twin_is_looked_at_first(shop):
    log = shop.log(seconds=6.0)
    astray = ud.track(shop.fit, with_current(log, 5.0 * log.joint("actual_current")), EKF())
    sound = ud.track(shop.fit, log.slice(0, 75), EKF())
    assert astray.restarts > sound.restarts == 0
    report = ud.diagnose(replace(sound, restarts=astray.restarts))
    assert report.document["recommendation"]["text"].startswith(ITS_TWIN)


def test_a_log_is_conditioned_for_its_own_arm_only(shop, ur5e):
    log = shop.log(seconds=2.0)
    assert ud.condition(log, ur5e).joints == 6
    short = {name: of[:, :5] if of.ndim == 2 else of for name, of in log.channels.items()}
    with pytest.raises(ud.UrdynError, match="has 5 joints, the arm 6"):
        ud.condition(ud.Log(log.t, short), ur5e)


def test_a_load_that_the_controller_is_set_to_is_a_notice_that_needs_no_attention(shop, ur5e):
    log = shop.log("payload_change:onset=8,mass=2", seconds=40.0, rate=25.0)
    late = log.t - log.t[0] >= 8.0
    fit = replace(shop.fit, tool_known=True)
    load = np.where(late, 2.0, 0.0)
    setting = {"payload": load, "payload_cog": np.zeros((len(log), 3))}
    track = ud.track(fit, replace(log, channels={**log.channels, **setting}))
    assert track.payload_setting["off_kg"] is None
    report = ud.diagnose(track)
    (finding,) = report.document["findings"]
    assert (finding["severity"], quiet(finding)) == ("notice", True)
    assert str(report).startswith("notice: payload_change")
