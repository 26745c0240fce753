"""A stretch of work compared with the commissioned model, row by row.

    r = i - i_commissioned(q, v, a, T)  =  H x + noise        x: how far the arm strayed

H are the derivatives of the observation model at the commissioned arm, with the instrumental
variable's accelerations: noise of a is in r too, and would be taken for a lack of inertia, above
all of the payload [Soderstrom2002]_. The model is held: nothing here learns.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from urdyn.dbn.robot_slice import presliding_doubt
from urdyn.diagnose.residual.space import Space
from urdyn.diagnose.residual.warmth import Warmth, usual
from urdyn.identify.design import SETTLED
from urdyn.model.drive import FRICTION, Drive
from urdyn.model.friction import Contact, friction_torque
from urdyn.types import Array, Mask, Motion

OWN = ("f", "alpha", "beta", "z", "o", "rotor")  # states that affect their joint's current alone
COULOMB, STRUCTURAL, HEALTH, ROTOR = (OWN.index(name) for name in ("f", "beta", "z", "rotor"))
SLIDING_DOUBT = 0.03  # [-] sd of the presliding state of a joint that slides; more where it creeps
SMEARED = 0.15  # [-] of a row, by which estimated kinematics may be off


@dataclass(frozen=True, eq=False)
class Rows:
    """Moments of work, with the commissioned arm's currents."""

    t: Array  # (N,) [s]
    q: Array  # (N, J) [rad]
    v: Array  # (N, J) [rad/s]
    load: Array  # (N, J) [N·m] rigid-body torque of the commissioned arm
    current: Array  # (N, J) [A] as measured
    predicted: Array  # (N, J) [A] of the commissioned arm
    tool: Array  # (N, J, 10) [A] per unit of payload, with the accelerations of `predicted`
    rigid: Array  # (N, J, c) [A] per unit of k, m, payload, with instrumental accelerations
    drive: Array  # (N, 6, J) [A] per unit of the own joint's states, as in OWN; likewise
    doubt: Array  # (N, J) [A] sd of the bristles' unknown part
    settled: Mask  # (N, J) slides on known bristles
    warm: Array  # (N, 3, J) as `warmth.unknowns` takes it
    shift: Array  # (N, J) [rad] by which the encoder's zero jumped

    def __len__(self) -> int:
        return len(self.t)

    @property
    def residual(self) -> Array:
        """Measured minus predicted, (N, J) [A]."""
        return self.current - self.predicted

    def zero(self, x: Array, row: int) -> float:
        """When x (N,) was zero, within the step to a row at which its sign had changed [s]."""
        share = x[row - 1] / (x[row - 1] - x[row])
        return float(self.t[row - 1] + share * (self.t[row] - self.t[row - 1]))

    def part(self, start: int, stop: int) -> Rows:
        """Rows start:stop; views, nothing is copied."""
        return Rows(**{f.name: getattr(self, f.name)[start:stop] for f in fields(self)})


def rows(space: Space, motion: Motion, s: Array, travelled: Array, warmth: Warmth) -> Rows:
    """A motion compared with the commissioned arm.

    Args:
        s: presliding state, (N, J) [-].
        travelled: travel of each joint since its bristles were unknown, (N, J) [rad].
        warmth: of the joints after the last row.
    """
    drive, arm = space.reference.drive, space.arm
    warm = _warm(warmth, drive)
    soft = np.exp(-usual(space) * np.nan_to_num(warm[0]))
    motion = replace(motion, temperature=np.broadcast_to(warmth.lubricant, motion.q.shape))
    q, v, a, instrument = motion.q, motion.v, motion.a, motion.instrumental
    Y, Z = arm.regressor(q, v, a), arm.regressor(q, v, instrument)
    load, likewise = Y @ arm.inertials.ravel(), Z @ arm.inertials.ravel()
    at = Contact(q, v, motion.temperature, load, s)
    besides = [name for name in FRICTION if name != "structural"]  # that depends on the load
    rest = friction_torque(at, drive, besides, {"viscous": soft})
    per = 1.0 / drive.gain
    held = drive.structural * np.sign(load) * s

    def current(load: Array, a: Array) -> Array:
        return np.asarray(per * ((1.0 + held) * load + drive.rotor_inertia * a + rest))

    predicted, through = current(load, a), (per * (1.0 + held))[..., None]
    A = np.concatenate(
        [arm.torque_derivatives(q, v, instrument)[0], Z @ space.shown, Z[..., -10:]], axis=2
    )
    own = {
        "f": drive.coulomb * s,
        "alpha": drive.viscous * soft * v,
        "beta": held * likewise,
        "z": -current(likewise, instrument) * drive.gain,
        "o": np.ones_like(load),
        "rotor": drive.rotor_inertia * instrument,
    }
    return Rows(
        t=motion.t,
        q=q,
        v=v,
        load=load,
        current=motion.current,
        predicted=predicted,
        tool=through * Y[..., -10:],
        rigid=through * A,
        drive=per * np.stack([own[name] for name in OWN], axis=1),
        doubt=_doubt(drive, v, load, predicted),
        settled=travelled > SETTLED * drive.presliding_distance,
        warm=np.broadcast_to(warm, (len(motion), *warm.shape)),
        shift=motion.shift,
    )


def _warm(warmth: Warmth, drive: Drive) -> Array:
    """Joint temperatures, as `warmth.unknowns` takes them, (3, J); NaN: not measured."""
    warm = np.stack([warmth.lubricant - drive.temperature, warmth.slope, warmth.left])
    warm[:, np.isnan(warm[0])] = np.nan
    return warm


def _doubt(drive: Drive, v: Array, load: Array, predicted: Array) -> Array:
    """Uncertainty from the bristles, and from smeared kinematics, sd (N, J) [A]."""
    grip = drive.coulomb + drive.structural * np.abs(load)
    doubt = (SLIDING_DOUBT + presliding_doubt(v)) * grip * (1.0 / drive.gain)
    if len(v) > 1:
        doubt = doubt + SMEARED * np.abs(np.gradient(predicted, axis=0))
    return np.asarray(doubt)


def joined(parts: tuple[Rows, ...]) -> Rows:
    """Rows concatenated."""
    if len(parts) == 1:
        return parts[0]
    return Rows(
        **{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Rows)}
    )


def derivatives(rigid: Array, drive: Array) -> Array:
    """H, (N, J, n), from columns that joints share (N, J, c) and their own (N, K, J)."""
    N, J, c = rigid.shape
    K = drive.shape[1]
    H = np.zeros((N, J, c + K * J))
    H[..., :c] = rigid
    for k in range(K):
        H[:, range(J), range(c + k * J, c + (k + 1) * J)] = drive[:, k]
    return H
