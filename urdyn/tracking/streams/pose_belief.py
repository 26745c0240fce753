"""What poses have shown of an arm so far, and how the first few initialise it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.errors import IdentifiabilityError
from urdyn.identify.kinematics.calibration import STRANGER, everything
from urdyn.identify.kinematics.gross import weights
from urdyn.identify.kinematics.moments import moments
from urdyn.identify.kinematics.placement import Placement, residuals
from urdyn.identify.kinematics.robust import begin, solve
from urdyn.identify.kinematics.spread import ANYWHERE
from urdyn.io.poses import READINGS, Poses
from urdyn.tracking.streams.conditional_filter import ConditionalBelief
from urdyn.types import Array, Gaussian, Index, freeze

FINEST = np.array([1e-6, 1e-6])  # [m, rad] resolution of a log's numbers
STAMPED = 1e-3  # [s] prior sd between the stamps of pose and angles


@dataclass(frozen=True, eq=False)
class Sights:
    """All that is remembered of a stream of poses."""

    gathered: Array  # (n, J + 6) angles and pose of those not yet learnt from
    table: Array  # (J, 5) a, alpha, beta, d, theta [m, rad], estimated
    base: Array  # (4, 4) transform_base_to_world
    tool: Array  # (4, 4) transform_tool_to_flange
    conditional: ConditionalBelief  # of geometry, base, tool; empty before they are known
    noise: Array  # (2,) sd of place [m] and turn [rad]
    late: float  # [s] sd of a pose's stamp
    count: float  # poses learnt from; 0 before base and tool are known
    reading: int  # convention of the three angles, index into READINGS
    q: Array  # (J,) [rad] where the arm was last seen; NaN: not yet
    still: bool  # whether it stood still there
    t: float  # [s] then
    doubted: int  # poses in a row that surprised

    def __post_init__(self) -> None:
        freeze(self, "table", "base", "tool", "noise")


@dataclass(frozen=True, eq=False)
class Build:
    """What is known of an arm's geometry before the first pose."""

    start: Placement  # as calibrated, or as drawn; base and tool arbitrary
    prior: Gaussian  # (P,) deviations from the drawing [m, rad]
    own: bool  # the poses are the controller's: by its own calibration, in its own base

    @property
    def columns(self) -> Index:
        """Which of a placement's unknowns are estimated: geometry, base, tool."""
        first = len(self.prior.mean)
        base = np.arange(0 if self.own else 6) + first
        return np.concatenate([np.arange(first), base, np.arange(6) + first + 6])

    @property
    def zeros(self) -> Index:
        """Columns of the joints' zeros theta, base first."""
        kinds = np.argwhere(self.start.form.free)[:, 1]
        return np.flatnonzero(kinds == 4)

    @property
    def precision(self) -> Array:
        """Prior precision of all columns."""
        Lambda = np.eye(len(self.columns)) / ANYWHERE**2
        first = len(self.prior.mean)
        Lambda[:first, :first] = np.linalg.inv(self.prior.cov)
        return Lambda

    def placement(self, sights: Sights) -> Placement:
        """The arm as estimated."""
        return replace(self.start, table=sights.table, base=sights.base, tool=sights.tool)

    def moved(self, sights: Sights, step: Array) -> Sights:
        """After a step of the estimated unknowns, (p,)."""
        whole = np.zeros(self.start.size)
        whole[self.columns] = step
        at = self.placement(sights).moved(whole)
        return replace(sights, table=at.table, base=at.base, tool=at.tool)


def nothing_seen(joints: int) -> Sights:
    """The state before the first pose."""
    empty = ConditionalBelief(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0), np.zeros((0, 0)))
    return Sights(
        gathered=np.zeros((0, joints + 6)),
        table=np.zeros((joints, 5)),
        base=np.eye(4),
        tool=np.eye(4),
        conditional=empty,
        noise=np.ones(2),
        late=STAMPED,
        count=0.0,
        reading=0,
        q=np.full(joints, np.nan),
        still=False,
        t=-np.inf,
        doubted=0,
    )


def begun(build: Build, sights: Sights, z: Gaussian) -> Sights | None:
    """The belief initialised by the gathered poses; None while base and tool are unidentifiable.

    It is the fit of `urdyn calibrate`, given the joints' zeros as believed by the currents.

    Args:
        z: joints' zeros, (J,); empty where the poses do not depend on them.
    """
    joints = build.start.table.shape[0]
    q, place, angles = np.split(sights.gathered, [joints, joints + 3], axis=1)
    acting = q + z.mean if len(z.mean) else q
    turned = bool(np.isfinite(angles).all())
    reading = READINGS[0] if build.own else ""
    poses = Poses(acting, place, angles if turned else None, reading, build.own)
    rng = np.random.default_rng(0)
    try:
        start, poses = begin(build.start, poses, rng)
        sought = everything(start, poses)
        expected = np.zeros(start.size)
        expected[: len(build.prior.mean)] = build.prior.mean
        found = solve(start, poses, replace(sought, expected=expected), rng)
    except IdentifiabilityError:
        return None
    if found.posterior.noise[0] > STRANGER:
        return None
    noise = np.maximum(found.posterior.noise, FINEST)
    step, cov = _exact(build, found.placement, poses, noise)
    at = replace(
        sights,
        gathered=sights.gathered[:0],
        table=found.placement.table,
        base=found.placement.base,
        tool=found.placement.tool,
        conditional=_conditional(build, cov, z),
        noise=noise,
        count=float(len(poses)),
        reading=READINGS.index(poses.reading),
    )
    return build.moved(at, step)


def _exact(build: Build, at: Placement, poses: Poses, noise: Array) -> tuple[Array, Array]:
    """The last step of the fit, with a correlated prior, and its covariance."""
    e = residuals(at, poses.q, poses.place, poses.turn)
    told = moments(at, poses.q, poses.place, poses.turn, weights(e, noise)).only(build.columns)
    offset = np.zeros(len(build.columns))
    offset[: len(build.prior.mean)] = build.prior.mean - at.deviations
    Lambda = build.precision
    H = np.tensordot(noise**-2.0, told.H, axes=1) + Lambda
    scale = 1.0 / np.sqrt(np.diag(H))
    cov = np.linalg.inv(scale[:, None] * H * scale) * scale[:, None] * scale
    cov = 0.5 * (cov + cov.T)
    return cov @ (noise**-2.0 @ told.b + Lambda @ offset), cov


def _conditional(build: Build, cov: Array, z: Gaussian) -> ConditionalBelief:
    """The belief given z: poses measure theta + z, so theta yields to z as far as they hold it."""
    zeros = np.zeros((len(cov), len(z.mean)))
    if len(z.mean):
        zeros[build.zeros, range(len(z.mean))] = 1.0
    return ConditionalBelief(cov @ build.precision @ zeros - zeros, cov, z.mean, z.cov)
