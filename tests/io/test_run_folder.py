"""A finding as a run's folder holds it has the fields of a finding."""

from __future__ import annotations

from dataclasses import fields

from urdyn.diagnose import Finding
from urdyn.io.run_folder import RANKS, SEVERITIES, Entry


def test_what_a_fleet_reads_of_a_finding_is_what_a_diagnosis_writes():
    assert set(Entry.__annotations__) <= {field.name for field in fields(Finding)}


def test_a_graver_finding_ranks_higher():
    assert sorted(RANKS, key=RANKS.__getitem__) == list(SEVERITIES)
