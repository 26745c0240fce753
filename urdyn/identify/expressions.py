"""Quantities as functions of standard scores, once, in CasADi: for values, derivatives, problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from urdyn.identify.unknowns import Unknowns
from urdyn.model.body import BODY, BODY_UNITS, ORDER
from urdyn.model.drive import LINEAR, SHAPE, UNITS, Drive
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import MAX_TAIL
from urdyn.types import Array, Parameters

FIELDS = ("gain", *LINEAR, *SHAPE)


@dataclass(frozen=True, eq=False)
class Quantities:
    """The physical quantities of an arm, as expressions of its scores."""

    inertials: Any  # (10, J) about the links' frames, Pinocchio's order
    payloads: Any  # (10, payloads) likewise, in the last joint's frame
    tool: Array  # (10,) likewise, known
    bodies: Any  # (10, J + payloads): mass, centre, inertia about the centre
    drive: Mapping[str, Any]  # FIELDS -> (J,)
    time_offset: Any  # [s]


def quantities(unknowns: Unknowns, z: Any) -> Quantities:
    """The quantities at scores `z`, a CasADi symbol (P,)."""
    x = ca.DM(unknowns.mean) + ca.DM(unknowns.sd) * z
    J, n = unknowns.prior.arm.joints, len(unknowns.drive)
    links = [_body(x[10 * j : 10 * j + 10]) for j in range(J)]
    drive, rest = x[10 * J : 10 * J + n], x[10 * J + n + 1 :]
    loads = [_body(rest[10 * k : 10 * k + 10]) for k in range(len(unknowns.payloads))]
    return Quantities(
        inertials=ca.horzcat(*[about_frame for about_frame, _ in links]),
        payloads=ca.horzcat(*[about_frame for about_frame, _ in loads]),
        tool=unknowns.tool,
        bodies=ca.horzcat(*[about_centre for _, about_centre in [*links, *loads]]),
        drive=_drive(unknowns, drive),
        time_offset=x[10 * J + n],
    )


def _drive(unknowns: Unknowns, x: Any) -> dict[str, Any]:
    """Drive fields; terms that a joint's model lacks are zero, unused shapes typical."""
    joints = unknowns.prior.arm.joints
    values: dict[str, list[Any]] = {name: [0.0] * joints for name in LINEAR}
    for name in ("gain", *SHAPE):
        values[name] = list(unknowns.prior.drive[name].typical)
    if unknowns.gain is not None:
        values["gain"] = list(unknowns.gain)
    for k, (name, j) in enumerate(unknowns.drive):
        values[name][j] = ca.exp(x[k]) if unknowns.prior.drive[name].positive else x[k]
    return {name: ca.vertcat(*column) for name, column in values.items()}


def _body(x: Any) -> tuple[Any, Any]:
    """Inertials about the frame, and (mass, centre, inertia about it), from log-Cholesky x."""
    d, s12, s23, s13, centre = x[1:4], x[4], x[5], x[6], x[7:10]
    U = ca.vertcat(
        ca.horzcat(ca.exp(d[0]), s12, s13),
        ca.horzcat(0, ca.exp(d[1]), s23),
        ca.horzcat(0, 0, ca.exp(d[2])),
    )
    mass, spread, one = ca.exp(2 * x[0]), U @ U.T, ca.DM.eye(3)
    inertia = mass * (ca.trace(spread) * one - spread)
    shift = mass * (ca.dot(centre, centre) * one - centre @ centre.T)
    return (
        ca.vertcat(mass, mass * centre, _six(inertia + shift)),
        ca.vertcat(mass, centre, _six(inertia)),
    )


def _six(inertia: Any) -> Any:
    """Ixx, Ixy, Iyy, Ixz, Iyz, Izz of a symmetric matrix."""
    return ca.vertcat(*[inertia[i, j] for i, j in np.transpose(ORDER).tolist()])


@lru_cache(maxsize=8)
def _compiled(unknowns: Unknowns) -> tuple[Any, Any]:
    """(everything that a Dynamics needs, the physical parameters and their Jacobian)."""
    z = ca.SX.sym("z", len(unknowns.mean))
    found = quantities(unknowns, z)
    drive = ca.horzcat(*[found.drive[name] for name in FIELDS])
    whole = [found.inertials, found.payloads, drive, found.time_offset]
    physical = ca.vertcat(ca.vec(found.bodies), ca.vec(drive), found.time_offset)
    return (
        ca.Function("whole", [z], whole),
        ca.Function("physical", [z], [physical, ca.jacobian(physical, z)]),
    )


def dynamics(
    unknowns: Unknowns, z: Array, friction_time: float, temperature: Array
) -> tuple[Dynamics, tuple[Array, ...]]:
    """The arm at scores `z`, with its tool only, and the payloads' inertials, (10,) each.

    Args:
        friction_time: by which friction reverses before the recorded motion [s].
    """
    inertials, payloads, drive, offset = (np.array(x) for x in _compiled(unknowns)[0](z))
    values = dict(zip(FIELDS, drive.T, strict=True))
    values["presliding_tail"] = np.clip(values["presliding_tail"], 0.0, MAX_TAIL)
    one = np.ones(unknowns.prior.arm.joints)
    values |= {"temperature": temperature, "health": one}
    ahead = float(offset.item())
    found = Drive(**values, time_offset=ahead, friction_lead=friction_time - ahead)
    arm = Dynamics(unknowns.prior.arm, inertials.T, found, unknowns.tool)
    return arm, tuple(payloads.T[: len(unknowns.payloads)])


def physical(unknowns: Unknowns, z: Array) -> tuple[Parameters, Array]:
    """Physical parameters at scores `z`, and their Jacobian in z, (Q, P)."""
    values, jacobian = (np.array(x) for x in _compiled(unknowns)[1](z))
    units = _units(unknowns)
    tails = [k for k, name in enumerate(units) if name.endswith(".presliding_tail")]
    values[tails] = np.clip(values[tails], 0.0, MAX_TAIL)  # as in the arm
    return Parameters(values.ravel(), tuple(units), tuple(units.values())), jacobian


def _units(unknowns: Unknowns) -> dict[str, str]:
    """Units of the physical parameters by name, in their order."""
    arm, payloads = unknowns.prior.arm, range(len(unknowns.payloads))
    bodies = [*arm.link_names, *(f"payload_{k}" for k in payloads)]
    of_bodies = {
        f"{body}.{x}": unit for body in bodies for x, unit in zip(BODY, BODY_UNITS, strict=True)
    }
    of_drives = {f"{joint}.{field}": UNITS[field] for field in FIELDS for joint in arm.joint_names}
    return of_bodies | of_drives | {"time_offset": "s"}
