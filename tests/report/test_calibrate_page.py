"""The page of a calibration: whole in itself, and nothing that a file says can act in it."""

from __future__ import annotations

import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from browser import Browser

from urdyn.identify.kinematics import Calibration, Recorded, calibrate, evaluate
from urdyn.io.poses import Poses
from urdyn.model.arm import Arm
from urdyn.model.geometry.chain_pose import flange
from urdyn.model.geometry.drawing import drawing_of
from urdyn.model.geometry.turns import rotation_vector
from urdyn.report.calibrate.page import calibrate_page, evaluate_page
from urdyn.report.calibrate.space import space_section
from urdyn.report.calibrate.summary import calibrated, evaluated
from urdyn.report.calibrate.words import deviation, label
from urdyn.report.markup import document
from urdyn.types import Defect, Source

HOSTILE = "<img src=x onerror=alert(1)>.csv"


class _Sources(HTMLParser):
    """What a page would fetch, and how many plots it has."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.plots = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        self.fetched += [v for k, v in attrs if k in ("src", "href") and v]
        self.plots += told.get("class") == "plot"


@pytest.fixture(scope="module")
def found(ur5e: Arm) -> Calibration:
    rng, form = np.random.default_rng(0), drawing_of(ur5e).form
    q = rng.uniform(-2.8, 2.8, (60, 6))
    pose = flange(form.table(1e-3 * rng.standard_normal(22)), q)
    place = pose[:, :3, 3] + 1e-5 * rng.standard_normal((60, 3))
    poses = Poses(
        q, place, rotation_vector(pose[:, :3, :3]), "rotvec", True,
        Source(HOSTILE, "0" * 64), (Defect("row", 2, 3, "left out"),),
    )  # fmt: skip
    return calibrate(ur5e, poses)


def test_the_page_fetches_nothing_and_escapes_what_files_say(found: Calibration) -> None:
    page = calibrate_page(found, calibrated(found, 1.0), "urdyn")
    read = _Sources()
    read.feed(page)
    assert read.fetched == []
    assert read.plots >= 2 + 2 + 1 + 2 + 6
    assert HOSTILE not in page
    assert "0" * 64 in page
    assert "no tool offset is set" in page


def test_the_map_of_the_workspace_shows_every_pose_on_a_narrow_screen(
    chromium: Browser, found: Calibration, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    page.write_text(document("", space_section(found, calibrated(found, 1.0))), encoding="utf-8")
    chromium.open(page, 420)
    axes = chromium.evaluate(
        """(({ xaxis, yaxis }) => JSON.stringify([xaxis.range, yaxis.range]))(
          document.querySelector(".plot")._fullLayout)"""
    )
    (left, right), (low, high) = json.loads(axes)
    across, height = np.hypot(*found.space.place[:, :2].T), found.space.place[:, 2]
    assert left <= 0.0 and across.max() <= right  # at 0 stands the arm
    assert low <= height.min() and height.max() <= high


def test_a_score_has_a_page_too(found: Calibration, ur5e: Arm, tmp_path) -> None:  # type: ignore[no-untyped-def]
    poses = replace(found.poses, source=Source("other.csv", "1" * 64))
    score = evaluate(ur5e, poses, Recorded(found.geometric.placement, None))
    page = evaluate_page(score, evaluated(score, 1.0), tmp_path, "urdyn")
    assert "base and tool fitted anew" in page
    assert "1" * 64 in page


def test_no_digit_is_finer_than_anybody_can_use() -> None:
    assert deviation(1.23456789e-4, 1e-9) == "0.1235"
    assert deviation(-1.23456789e-4, 1e-5) == "−0.123 ± 0.016"


def test_what_is_told_of_a_joint_is_told_by_its_whole_name() -> None:
    assert label("elbow.1_joint.alpha") == "elbow.1 · alpha"
