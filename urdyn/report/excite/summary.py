"""An excitation in numbers and in a table: what will be known, and what was proven."""

from __future__ import annotations

from typing import Any

from rich.table import Table

from urdyn.identify.excite import Excitation
from urdyn.identify.excite.rating import Rating, scale
from urdyn.io.plain import plain
from urdyn.report.digits import number, percent
from urdyn.report.names import spoken
from urdyn.report.terminal import terminal_table
from urdyn.simulate.fourier import Series
from urdyn.version import __version__

FRICTION = ("coulomb", "viscous", "structural", "offset", "rotor_inertia", "gain")
MASS = ("mass", "com_x", "com_y", "com_z")


def rating(found: Excitation) -> Rating:
    """What the motion is worth in base parameters."""
    rows = found.trajectory
    some = slice(None, None, max(1, len(rows) // 500))
    motion = rows.q[some], rows.v[some], rows.a[some]
    return scale(found.question).rate(*motion, found.ask.duration * found.question.rate)


def excited(found: Excitation, wall: float) -> dict[str, Any]:
    """An excitation in numbers; `wall` is the time that it took [s]."""
    ask, arm, proof = found.ask, found.arm, found.proof
    rated = rating(found)
    links = [*arm.link_names, *(["payload_0"] if found.question.unknowns.payloads else [])]
    series = isinstance(found.path, Series)
    return {
        "urdyn": __version__,
        "robot": arm.name,
        "kind": ask.kind,
        "duration_s": ask.duration,
        "rate_hz": ask.rate,
        "rows": len(found.trajectory),
        "seed": ask.seed,
        "wall_s": round(wall, 3),
        "criterion": ask.criterion,
        "interest": list(ask.interest),
        "value": found.value,
        "restarts": list(found.values),
        "harmonics": len(found.path.sine) if isinstance(found.path, Series) else None,
        "base_frequency_hz": 1.0 / found.path.lasting if series else None,
        "base_log_det": plain(rated.log_det),
        "base_condition": plain(rated.condition),
        "proof": {
            "clearance_m": proof.clearance,
            "closest": list(proof.closest),
            "shares": proof.shares,
            "poses": proof.looked,
        },
        "joints": [
            {"name": joint} | {field: spread(found, f"{joint}.{field}") for field in FRICTION}
            for joint in arm.joint_names
        ],
        "links": [
            {"name": link} | {field: spread(found, f"{link}.{field}") for field in MASS}
            for link in links
        ],
    }


def spread(found: Excitation, name: str) -> dict[str, Any]:
    """A parameter's sd before and after."""
    told = found.expected
    k = told.parameters.names.index(name)
    return {
        "value": float(told.parameters.values[k]),
        "sd_before": float(told.before[k]),
        "sd_after": float(told.after[k]),
        "unit": told.parameters.units[k],
    }


def excited_table(found: Excitation) -> Table:
    """What will be known of every joint."""
    fields = ("coulomb", "viscous", "structural", "rotor_inertia", "gain")
    heads = (
        "sd before → after",
        "Coulomb [N·m]",
        "viscous [N·m·s/rad]",
        "load friction",
        "rotor [kg·m²]",
        "gain [N·m/A]",
    )
    rows = []
    for joint in found.arm.joint_names:
        cells = (spread(found, f"{joint}.{field}") for field in fields)
        told = (f"{number(c['sd_before'])} → {number(c['sd_after'])}" for c in cells)
        rows.append((spoken(joint), *told))
    return terminal_table("", heads, rows)


def safety(found: Excitation) -> str:
    """What was proven, in a sentence."""
    proof = found.proof
    shares = ", ".join(f"{kind} {percent(share)}" for kind, share in proof.shares.items())
    one, other = (spoken(name.rstrip("0123456789").rstrip("_")) for name in proof.closest)
    return (
        f"Proven safe at every moment, also between rows: {1e3 * proof.clearance:.0f} mm or more "
        f"between everything ({other} and {one} come closest); of the limits at most {shares}."
    )
