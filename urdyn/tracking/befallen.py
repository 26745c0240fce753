"""What befell an arm at once: another payload, or something in one joint's drive.

Each leaves a signature of its own in the white innovations e: a payload that of its inertials in
all joints' currents, a drive that of its friction, its damping and its load in its own. With the
rows phi of such a signature and theta ~ N(0, P), innovations of the last seconds are more likely
under it than under noise by

    log B = s' (Lambda + M)^-1 s / 2 - log |I + P M| / 2,    s = sum phi e,  M = sum phi' phi,

Lambda = P^-1: the likelihood ratio of [Willsky1976]_, averaged over what is possible rather than
maximised, so that signatures of more parameters are not preferred.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.dbn.robot_slice import ROWS, RobotSlice
from urdyn.estimate import Innovation
from urdyn.model.drive import Drive
from urdyn.tracking.model import JOLTS, PAYLOAD_SD
from urdyn.types import Array, Mask, frozen

MEMORY = 2.0  # [s] over which evidence is gathered
CLIP = 3.0  # [sd] that an innovation counts for at most
SURE = 30.0  # [-] log odds; what nobody models in a healthy arm has been seen to reach 22
LIKELY = 10.0  # [-] of what may have befallen it besides, or in its place
CARRIED = slice(-10, -6)  # columns of a slice's A: mass and first moments of the payload
OWN = [ROWS.index(name) - len(ROWS) for name in ("s", "v", "load")]  # and of all that is packed


@dataclass(frozen=True, eq=False)
class Evidence:
    """Sums of the last seconds: products of each joint's signatures with one another and with e."""

    sums: Array  # (J, 8, 8) four of the payload, three of the drive, and e

    def __post_init__(self) -> None:
        object.__setattr__(self, "sums", frozen(self.sums))

    @property
    def payload(self) -> Array:
        """M and s, (4, 5)."""
        return np.asarray(self.sums[:, :4, [0, 1, 2, 3, 7]].sum(axis=0))

    @property
    def drives(self) -> Array:
        """Of each joint's, (J, 3, 4)."""
        return self.sums[:, 4:7, 4:]


def none_yet(joints: int) -> Evidence:
    """Nothing has been gathered."""
    return Evidence(np.zeros((joints, 8, 8)))


def gathered(
    evidence: Evidence, white: RobotSlice, drive: Drive, told: Innovation, dt: float
) -> Evidence:
    """One innovation on; `white` is the slice after the filter that made its noise white."""
    known = np.isfinite(told.residual)
    sd = np.sqrt(np.where(known, np.diag(told.cov), 1.0))
    e = np.minimum(np.maximum(np.where(known, told.residual, 0.0) / sd, -CLIP), CLIP)
    signatures = np.concatenate([white.A[:, CARRIED], white.packed[:, OWN]], axis=1)
    signatures *= (known / (drive.gain * sd))[:, None]
    row = np.concatenate([signatures, e[:, None]], axis=1)
    return Evidence(np.exp(-dt / MEMORY) * evidence.sums + row[:, :, None] * row[:, None, :])


def befallen(evidence: Evidence, drive: Drive) -> Mask:
    """What is to be taken for known no longer, (1 + J,): the payload, and each joint's drive.

    Nothing, until something is sure; then all that is likely, for the next seconds tell which.
    """
    odds = log_odds(evidence, drive)
    return np.asarray((odds > LIKELY) & (odds.max() > SURE))


def log_odds(evidence: Evidence, drive: Drive) -> Array:
    """How much likelier than noise each is, (1 + J,): the payload, then the joints' drives."""
    size = {"f": drive.coulomb, "alpha": drive.viscous, "z": np.ones_like(drive.gain)}
    own = np.stack([sd * size[group] for group, sd in JOLTS.items()], axis=1)
    carried = _log_odds(evidence.payload[None], PAYLOAD_SD[None, :4])
    return np.concatenate([carried, _log_odds(evidence.drives, own)])


def _log_odds(sums: Array, sd: Array) -> Array:
    """Of signatures (k, n, n + 1) whose parameters have these standard deviations, (k, n)."""
    n = sd.shape[1]
    M = sums[:, :, :n] * sd[:, :, None] * sd[:, None, :]
    s = sums[:, :, n] * sd
    A = M + np.eye(n)
    fit = np.einsum("kn,kn->k", s, np.linalg.solve(A, s[..., None])[..., 0])
    return np.asarray(0.5 * (fit - np.linalg.slogdet(A)[1]))
