"""A diagnosis that is killed goes on at what it kept, and says the same."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose.job import Job
from urdyn.diagnose.onlooker import Onlooker
from urdyn.diagnose.session import Session
from urdyn.errors import InputError
from urdyn.estimate import Innovation
from urdyn.tracking import Reading
from urdyn.types import Gaussian

NOWHERE = Gaussian(np.zeros(1), np.eye(1))
UNSURPRISED = Innovation(np.zeros(6), np.eye(6), 0.0, 0.0, 6)


def looking_on(shop: Shop, log) -> Onlooker:
    of = shop.diagnosis(log)
    return Onlooker(of.fit, of.period, of.rules, {})


def readings(shop: Shop, log):
    from test_diagnosis_laws import instants

    for now in instants(shop, log):
        i = now.instant
        told = i.t, i.current, i.current, i.current, UNSURPRISED, False
        inputs: Any = SimpleNamespace(s=now.s)
        yield Reading(*told, i, now.travelled, inputs, lambda: NOWHERE)


def test_a_killed_diagnosis_goes_on_and_finds_the_same(shop: Shop, tmp_path: Path) -> None:
    log, identity = (
        shop.log("collision:link=4,force=90/0/60,onset=4", seconds=6.0, rate=100.0),
        {"twin": "a"},
    )
    whole, killed = looking_on(shop, log), looking_on(shop, log)
    (tmp_path / "whole").mkdir()
    whole.begin(tmp_path / "whole", 0, identity)
    (tmp_path / "killed").mkdir()
    killed.begin(tmp_path / "killed", 0, identity)
    for k, reading in enumerate(readings(shop, log)):
        whole.take(reading)
        if k < 413:
            killed.take(reading)
        if k in (200, 300, 400):
            killed.keep(k + 1)
            assert killed.kept(wait=True)
    whole.finish()
    again = looking_on(shop, log)
    again.begin(tmp_path / "killed", 401, identity)
    for reading in list(readings(shop, log))[401:]:
        again.take(reading)
    again.finish()
    one, other = (
        json.loads((tmp_path / name / "findings.json").read_text()) for name in ("whole", "killed")
    )
    assert one == other
    assert len(one["findings"]) == 1


def test_a_run_without_its_memory_says_how_to_begin_anew(shop: Shop, tmp_path: Path) -> None:
    looking = looking_on(shop, shop.log(seconds=2.0))
    with pytest.raises(InputError, match="--fresh"):
        looking.begin(tmp_path, 300, {"twin": "a"})


def test_what_a_run_goes_on_from_is_kept_until_the_run_is_kept_later(
    shop: Shop, tmp_path: Path
) -> None:
    """Though one that was killed before had come as far as the next."""
    of = shop.diagnosis(shop.log(seconds=2.0))
    session = Session(Job(of.fit, of.period, of.rules, tmp_path, 0, {"twin": "a"}, {}))
    for sample in (1000, 2000, 2000):
        session.keep(sample)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "diagnosis-1000.npz",
        "diagnosis-2000.npz",
    ]
    session.keep(3000)
    assert not (tmp_path / "diagnosis-1000.npz").exists()


def test_what_was_written_with_a_sample_is_not_written_with_every_later_one(
    shop: Shop, tmp_path: Path
) -> None:
    """Or a live run would write gigabytes an hour, most of it what a checkpoint has held before."""
    of = shop.diagnosis(shop.log(seconds=2.0))
    session = Session(Job(of.fit, of.period, of.rules, tmp_path, 0, {"twin": "a"}, {}))
    session.keep(1000)
    (whole,) = (path.stat().st_size for path in tmp_path.iterdir())
    session.keep(2000)
    before = set(tmp_path.iterdir())
    session.keep(3000)
    (newest,) = set(tmp_path.iterdir()) - before
    assert newest.stat().st_size < 0.1 * whole


def test_what_is_kept_again_is_waited_for_again(shop: Shop, tmp_path: Path) -> None:
    """A recording may end where it was just kept: what is written after its end would be left."""
    looking = looking_on(shop, shop.log(seconds=2.0))
    looking.begin(tmp_path, 0, {"twin": "a"})
    for _ in range(2):
        looking.keep(1000)
        assert not looking.kept(wait=False)
        assert looking.kept(wait=True)
    looking.forget()
    looking.close()
    assert [path.name for path in tmp_path.iterdir()] == ["findings.json"]
