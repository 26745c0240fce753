"""Runs as `urdyn track` leaves them: a history in which nothing happens, and what was found."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from urdyn.diagnose import Finding
from urdyn.diagnose.findings.document import ORIGIN, findings_document
from urdyn.diagnose.findings.prognosis import Course
from urdyn.diagnose.kinds.rules_file import read_rules

ROWS, START, STEP = 6000, 1000.0, 0.01
T = START + STEP * np.arange(ROWS)  # [s] as a controller stamps it
JOINTS = ("shoulder_joint", "elbow_joint")
COMMISSIONED = {  # mean and sd
    "coulomb": (5.0, 0.1),
    "friction": (9.0, 0.1),
    "viscous": (8.0, 0.1),
    "structural": (0.1, 0.01),
    "health": (1.0, 0.01),
    "offset": (0.0, 0.1),
    "zero": (0.0, 3e-4),
}
UNITS = {
    "coulomb": "N·m", "friction": "N·m", "viscous": "N·m·s/rad", "offset": "N·m", "zero": "rad",
    "mass": "kg", "mx": "kg·m",
}  # fmt: skip
PEAK = 7.5  # [A] of one sample
WARNING, CRITICAL = 0.2, 0.5
HOUSE = read_rules()


def columns(joints=JOINTS, rows=ROWS, step=STEP) -> dict[str, np.ndarray]:
    """A run in which nothing happens, but for one peak of current and a payload of 2 kg."""
    rng, t = np.random.default_rng(0), START + step * np.arange(rows)
    beliefs = {f"{j}.{q}": b for j in joints for q, b in COMMISSIONED.items()}
    beliefs |= {f"{j.replace('joint', 'link')}.mass": (4.0, 0.4) for j in joints}
    beliefs |= {"payload.mass": (2.0, 0.1), "payload.mx": (0.1, 0.01)}
    table = {"t": t}
    for name, (mean, sd) in beliefs.items():
        table |= {name: np.full(rows, mean), f"{name}.sd": np.full(rows, sd)}
    left = 0.1 * rng.standard_normal((rows, len(joints)))
    left[rows // 3, 0] = PEAK
    left[rows // 2 : rows // 2 + 500] = np.nan
    measured = np.isfinite(left).sum(axis=1)
    for j in range(len(joints)):
        table |= {f"current_{j}": np.sin(t), f"predicted_{j}": np.sin(t) - left[:, j]}
    nis = rng.chisquare(len(joints), rows)
    return table | {"nis": nis, "measured": measured, "widened": np.zeros(rows, bool)}


def write(path: Path, table: dict[str, np.ndarray], **metadata: object) -> Path:
    """As a Parquet file with the metadata of a history."""
    units = {name: UNITS[q] for name in table if (q := name.rpartition(".")[2]) in UNITS}
    told = {f"urdyn.{k}": json.dumps(v) for k, v in ({"units": units} | metadata).items()}
    pq.write_table(pa.table(table).replace_schema_metadata(told), path, row_group_size=4096)
    return path


def summary(**changed: object) -> dict[str, object]:
    """Of a run that nobody diagnosed."""
    quality = {
        "gaps": 1, "missing": 12, "longest_step_s": 0.13, "repeated": 0, "clock_set": 0,
        "restarts": 0, "refused": 2, "undrawn": 0, "undriven": 0, "in_contact": 0, "stuck": [0, 3],
        "frozen": [], "without_current": [0.0, 0.001], "defects": ["3 x torn row (left out)"],
        "too_sparse": {"since": START + 20.0, "for_s": 9.0, "step_s": 0.12, "period_s": 0.01},
    }  # fmt: skip
    return {
        "robot": "ur5e", "samples": ROWS, "data_s": 60.0, "wall_s": 6.0, "rate_hz": 1000.0,
        "latency_ms": {"p50": 1.0, "p99": 2.0, "max": 9.0}, "rss_mb": 300.0, "filter": "EKF",
        "mode": "log", "final": {}, "payload_changes": [],
        "payload_known": True, "quality": quality,
    } | changed  # fmt: skip


def growing(rate=4e-3, rate_sd=4e-4, joint=1, name="elbow_joint") -> Finding:
    """Friction that has grown by 10 per cent in half a minute."""
    course = Course(START + 55.0, 0.1, 0.01, rate, rate_sd)
    forecast = course.forecast(WARNING, CRITICAL)
    t = START + np.arange(30.0, 56.0, 5.0)
    size = 0.1 - rate * (t[-1] - t)
    return Finding(
        id=f"friction_increase.{name}", kind="friction_increase", joint=joint, name=name,
        onset_s=START + 30.0, onset_interval_s=(START + 25.0, START + 34.0),
        alarm_s=START + 45.0, severity="notice", confidence=0.99,
        time_to_failure_s=forecast and forecast["to_critical_s"], forecast=forecast,
        size=0.1, size_sd=0.01, quantity="Coulomb friction", unit="-",
        text=f"{name}: Coulomb friction +10.0 %", advice="check lubrication",
        evidence={"nats": 20.0, "series": {
            "t": t.tolist(), "size": size.tolist(), "sd": [0.01] * len(t)}},
    )  # fmt: skip


def diagnosed(*findings: Finding, joints=JOINTS, judged=True, rules=HOUSE) -> dict[str, object]:
    """What a diagnosis by these rules adds to a summary."""
    judged = [judged] * len(joints) if isinstance(judged, bool) else judged
    probes = [{"name": j, "observable": False, "probe": f"turn {j} quickly"} for j in joints]
    document = findings_document(findings, joints, judged, probes, {}, {}, rules)
    return {name: of for name, of in document.items() if name not in ORIGIN}
