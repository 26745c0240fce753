"""From a log to a page in three calls."""

from __future__ import annotations

import pytest

import urdyn as ud
from urdyn.errors import InputError


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


def test_a_log_is_conditioned_for_its_own_arm_only(shop, ur5e):
    log = shop.log(seconds=2.0)
    assert ud.condition(log, ur5e).joints == 6
    short = {name: of[:, :5] if of.ndim == 2 else of for name, of in log.channels.items()}
    with pytest.raises(ud.UrdynError, match="has 5 joints, the arm 6"):
        ud.condition(ud.Log(log.t, short), ur5e)
