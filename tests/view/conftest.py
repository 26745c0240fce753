"""What the tests of this room share: a tracked run of a virtual arm, whose elbow grows stiff."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from urdyn.estimate import EKF
from urdyn.identify import Fit
from urdyn.io import sha256, write
from urdyn.simulate import simulate
from urdyn.tracking import Tracker, open_source, run
from urdyn.twin import Twin
from urdyn.types import Log


@dataclass(frozen=True)
class Tracked:
    fit: Fit
    log: Log
    recording: Path
    twin: Path
    out: Path

    def tracker(self) -> Tracker:
        return Tracker(self.fit, EKF(), open_source(str(self.recording)).period)


@pytest.fixture(scope="session")
def tracked_run(identified: Fit, tmp_path_factory: pytest.TempPathFactory) -> Tracked:
    folder = tmp_path_factory.mktemp("tracked")
    log = simulate(identified.dynamics.arm, 5.0, 100.0, 1)[0]
    recording, twin, out = folder / "log.parquet", folder / "twin.toml", folder / "monday"
    write(log, recording)
    Twin(identified.dynamics.arm, identified).save(twin)
    told = Tracked(identified, log, recording, twin, out)
    run(told.tracker(), open_source(str(recording)), out, sha256(twin))
    return told
