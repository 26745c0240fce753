"""Abrupt changes of an arm: another payload, or a change in one joint's drive.

Each leaves its own signature in the white innovations e: a payload that of its inertials in all
joints' currents; a drive that of its friction, damping and load in its own current. With the rows
phi of such a signature and theta ~ N(0, P), innovations of the last seconds are more likely under
it than under noise by

    log B = s' (Lambda + M)^-1 s / 2 - log |I + P M| / 2,    s = sum phi e,  M = sum phi' phi,

Lambda = P^-1: the likelihood ratio of [Willsky1976]_, averaged over the prior rather than
maximised, so that signatures of more parameters are not preferred. A row whose e is beyond CLIP is
scaled down with its signature, as if its noise were larger: a large change keeps its signature's
shape, and a torn sample counts for little.

Wear over minutes, faster than a healthy arm drifts, never stands out within a few seconds. It
shows in innovations summed over longer times: the slower the wear, the longer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp

import numpy as np

from urdyn.dbn.robot_slice import COLUMN, RobotSlice
from urdyn.estimate import Innovation
from urdyn.model.drive import Drive
from urdyn.tracking.belief.model import JOLTS, PAYLOAD_SD
from urdyn.tracking.noise.slow_noise_absorption import (
    SlowNoiseAbsorption,
    after_absorption,
    no_absorption,
)
from urdyn.types import Array, Gaussian, Mask, changed, freeze

MEMORY = 2.0  # [s] over which evidence is gathered
WEAR_MEMORY = np.array([20.0, 120.0])  # [s] the same, for drives alone
CLIP = 3.0  # [sd] beyond which an innovation counts as that large
SURE = 30.0  # [-] log odds; unmodelled effects in a healthy arm have been seen to reach 22
# [-] log odds of wear, over each time; pairs of a UR10e's twin and a run reached 11.4 and 20.3
WORN = np.array([20.0, 30.0])
LIKELY = 5.0  # [-] below the likeliest: a change that may have happened as well, or instead
RARE = 10.0  # [-] by which a change in a drive is less likely than another payload
BOTH = 30.0  # [-] the same for both at once: a large payload affects more than its signature says
TOLD = 3.0  # [sd] from the assumed payload: closer than this, that is kept
LASTS = 0.24  # [s] of later samples that must confirm it: a knock and its rebound are over by then
BORNE = 0.7  # [-] share of its log odds that must last
# Rows and columns of the sums: signatures of a payload, those of a drive, and e, common to both.
LOADS, DRIVES = 4, len(JOLTS)  # mass and first moments; friction, damping and health
WIDTH = LOADS + DRIVES + 1
PAYLOAD, DRIVE = slice(LOADS), slice(LOADS, LOADS + DRIVES)
OF_PAYLOAD, OF_DRIVE = np.ones((2, WIDTH), dtype=bool)  # each including e
OF_PAYLOAD[DRIVE] = OF_DRIVE[PAYLOAD] = False
COMMON = OF_PAYLOAD & OF_PAYLOAD[:, None]  # summed over all joints
# Where these signatures come from: a slice's A, whose last columns are the payload's inertials,
# and its packed s, v and load.
INERTIALS = len(PAYLOAD_SD)
A_LOADS = slice(-INERTIALS, LOADS - INERTIALS)
OWN = slice(COLUMN["s"], COLUMN["load"] + 1)


@dataclass(frozen=True, eq=False)
class Evidence:
    """Sums of the last seconds: products of each joint's signatures with one another and with e.

    A large change shows at once, but samples from before it count against it; so there are sums
    of the last seconds, and sums since noise was last the likeliest hypothesis [Page1954]_.
    """

    sums: Array  # (2, J, WIDTH, WIDTH) four of the payload, three of the drive, and e
    wear: Array  # (k, J, 4, 4) three of the drive, and e, over each longer time
    absorbed: SlowNoiseAbsorption  # of the drive's signatures
    highest: float = 0.0  # log odds of a change, if it lasts; 0: nothing is sure
    lasted: float = 0.0  # [s] of measurements that have confirmed it since

    def __post_init__(self) -> None:
        freeze(self, "sums", "wear")


@dataclass(frozen=True, eq=False)
class PriorScales:
    """How large changes are expected to be: products of their signatures' sd, and 1 of e."""

    at_once: Array  # (1 + 2 J, WIDTH, WIDTH) of a payload, of each drive, and of both
    wear: Array  # (J, 4, 4) of each drive

    @classmethod
    def of(cls, drive: Drive) -> PriorScales:
        """Scales for an arm with these drives."""
        one = np.ones_like(drive.gain)
        size = {"f": drive.coulomb, "alpha": drive.viscous, "z": one}
        jolts = np.stack([*(jolt * size[group] for group, jolt in JOLTS.items()), one], axis=1)
        sd = np.concatenate([np.tile(PAYLOAD_SD[PAYLOAD], (len(one), 1)), jolts], axis=1)
        at_once = np.concatenate([sd[:1] * OF_PAYLOAD, sd * OF_DRIVE, sd])
        return cls(*(of[:, :, None] * of[:, None, :] for of in (at_once, jolts)))


def no_evidence(joints: int) -> Evidence:
    """Evidence before the first innovation."""
    wear = np.zeros((len(WEAR_MEMORY), joints, DRIVES + 1, DRIVES + 1))
    return Evidence(np.zeros((2, joints, WIDTH, WIDTH)), wear, no_absorption(joints, DRIVES))


def drive_evidence(evidence: Evidence) -> Evidence:
    """The evidence on drives alone: what is carried is unknown from here on."""
    kept = np.array(evidence.sums)
    kept[..., PAYLOAD, :] = kept[..., :, PAYLOAD] = 0.0
    return replace(evidence, sums=kept, highest=0.0, lasted=0.0)


def accumulated(
    evidence: Evidence, white: RobotSlice, drive: Drive, innovation: Innovation, dt: float
) -> Evidence:
    """The evidence after one more innovation; `white` is the slice whose noise was whitened."""
    known = np.isfinite(innovation.residual)
    sd, residual = np.sqrt(innovation.cov.diagonal())[:, None], innovation.residual[:, None]
    borne = white.A[:, A_LOADS] + drive.structural[:, None] * white.A_hold[:, A_LOADS]
    signatures = np.concatenate([borne, white.packed[:, OWN]], axis=1) / drive.gain[:, None]
    lasting, absorbed = after_absorption(evidence.absorbed, white, signatures[:, DRIVE], known, dt)
    rows = np.concatenate([signatures, residual, lasting, residual], axis=1)
    rows /= np.maximum(np.abs(residual) / CLIP, sd)
    if (measured := np.count_nonzero(known)) < len(known):
        rows[~known] = 0.0
    at_once, wear = rows[:, :WIDTH], rows[:, WIDTH:]
    slowly = np.exp(-dt / WEAR_MEMORY)[:, None, None, None]
    return changed(
        evidence,
        sums=exp(-dt / MEMORY) * evidence.sums + at_once[:, :, None] * at_once[:, None, :],
        wear=slowly * evidence.wear + wear[:, :, None] * wear[:, None, :],
        absorbed=absorbed,
        lasted=evidence.lasted + dt * bool(measured),
    )


@dataclass(frozen=True, eq=False)
class AbruptChange:
    """What changed abruptly, and so is no longer assumed to be known."""

    payload: Array | None  # (10,) approximate payload from here on; None: no change
    drives: Mask  # (J,)
    wears: bool = False  # whether they go on wearing
    known: Gaussian | None = None  # the belief that allows for the change from the start
    weighed: bool = False  # the payload was exchanged at a rest, and estimated since

    @property
    def anything(self) -> bool:
        """Whether anything changed."""
        return self.payload is not None or bool(self.drives.any())


def detect(evidence: Evidence, sizes: PriorScales, before: Array) -> tuple[AbruptChange, Evidence]:
    """The change of an arm that carried a payload `before`, (10,), and the evidence that is left.

    No change until one was sure and most of its odds have lasted; then all likely changes, for the
    next seconds show which it was. Evidence for noise is not kept.
    """
    odds, J = log_odds(evidence, sizes), len(sizes.wear)
    of = odds.max(axis=1).argmax()
    surest, top = odds[of], float(odds[of].max())
    borne_out = top > BORNE * evidence.highest > 0.0
    highest = max(top, evidence.highest * borne_out)
    likely = (surest > top - LIKELY) & (borne_out and evidence.lasted > LASTS)
    payload, drives, both = likely[0], likely[1 : 1 + J], likely[1 + J :]
    drives, another = drives | both, bool(payload | both.any())
    carried = _carried(evidence.sums[of], before[PAYLOAD]) if another else None
    kept = evidence.sums * np.array([1.0, float(odds[1].max() > 0.0)])[:, None, None, None]
    highest *= highest > SURE
    lasted = evidence.lasted * borne_out
    evidence = changed(evidence, sums=kept, highest=highest, lasted=lasted)
    return AbruptChange(carried, drives), evidence


def wearing_drive(evidence: Evidence, sizes: PriorScales) -> Mask:
    """The drive that surely wears, if any, (J,); others may follow once that one is known."""
    beyond = (_log_odds(evidence.wear, sizes.wear) - WORN[:, None]).max(axis=0)
    return np.asarray((beyond > 0.0) & (beyond == beyond.max()))


def _carried(sums: Array, before: Array) -> Array:
    """The payload now, (10,), from all joints' `sums`; mass and first moments were `before`, (4,).

    The signatures are linearised about the payload before and assume a known arm; they say nothing
    of inertia.
    """
    whole, payload = sums.sum(axis=0), np.zeros(len(PAYLOAD_SD))
    M, s = whole[PAYLOAD, PAYLOAD], whole[PAYLOAD, -1]
    cov = np.linalg.inv(M + np.diag(PAYLOAD_SD[PAYLOAD] ** -2))
    payload[PAYLOAD] = significant(np.zeros(LOADS), cov @ (s + M @ before), np.sqrt(np.diag(cov)))
    return payload


def significant(before: Array, now: Array, sd: Array) -> Array:
    """The payload: `before` unless it differs significantly from that; 0 where it may be 0.

    Health and gain are learnt from what they multiply. To go on believing in a piece that was put
    down, because two seconds show little, would bias them by its weight alike in every hold.
    """
    same, none = (np.abs(now - thought) < TOLD * sd for thought in (before, 0.0))
    return np.where(none, 0.0, np.where(same, before, now))


def log_odds(evidence: Evidence, sizes: PriorScales) -> Array:
    """Log odds of each change over noise, by each sum: (2, 1 + 2 J), payload, drives, and both.

    A payload affects every joint's current, and each drive could be blamed for its own; both within
    seconds are rare, and need evidence that neither explains alone.
    """
    sums, J = evidence.sums, len(sizes.wear)
    sums = np.where(COMMON, sums.sum(axis=1, keepdims=True), sums)
    odds = _log_odds(np.concatenate([sums[:, :1], sums, sums], axis=1), sizes.at_once)
    return np.asarray(odds - np.repeat([0.0, RARE, BOTH], [1, J, J]))


def _log_odds(sums: Array, scale: Array) -> Array:
    """Log odds from sums (..., k, n + 1, n + 1) of signatures and e; `scale`: products of prior sd.

    With S the signatures' part and s the products with e, a Cholesky factor L of

        [[I + P S, P s], [.., 1 + e' e]]

    in units of the prior sd contains all of it: its last row is what e says of the parameters.
    """
    L = np.linalg.cholesky(sums * scale + np.eye(scale.shape[-1]))
    lost = np.log(np.diagonal(L, axis1=-2, axis2=-1)[..., :-1]).sum(axis=-1)
    return np.asarray(0.5 * (L[..., -1, :-1] ** 2).sum(axis=-1) - lost)
