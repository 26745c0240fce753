"""All of a log's information in small matrices: whitened, weighted, QR-compressed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.identify.band import EVERYTHING, Band
from urdyn.identify.design import Design, blocks, coefficients_at, design, runs
from urdyn.identify.map_estimate import Compressed
from urdyn.identify.noise import Noise
from urdyn.identify.slow import periodogram
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array, Mask, Motion


def compress(
    point: Dynamics,
    motion: Motion,
    noise: Noise,
    payload: int | None = None,
    band: Band = EVERYTHING,
) -> list[Compressed]:
    """One small problem a joint, as large as it has columns, however long the motion was.

    Args:
        point: where the columns are taken; its prediction tells outliers from data.
        noise: colour, scale and tails of the current.
        payload: index of the payload that `point` carries; None: none.
        band: in which the current is compared.
    """
    coefficients = coefficients_at(point)
    R = [np.zeros((0, len(w) + 1)) for w in coefficients]
    for block in blocks(point, motion):
        problem, other = design(point, block), block.instrumental
        instrument = problem if other is block else design(point, other)
        for j, w in enumerate(coefficients):
            rows = np.vstack([R[j], *_weighted(problem, instrument, j, noise, w, band)])
            R[j] = np.asarray(np.linalg.qr(rows, mode="r"))
    return [Compressed(j, payload, triangle) for j, triangle in enumerate(R)]


def _weighted(
    problem: Design,
    instrument: Design,
    joint: int,
    noise: Noise,
    coefficients: Array,
    band: Band,
) -> list[Array]:
    """Rows [Phi | i] of unit, white, Gaussian-equivalent noise, run by run.

    Phi is the instrument's, and leaves of i at the point what the problem's own does: noise of
    accelerations is in one of the two alone, so that none of it is learnt from. [Soderstrom2002]_
    """
    rows = []
    data = np.column_stack([problem.columns(joint), problem.current[:, joint]])
    tool = instrument.columns(joint)
    for run in runs(problem.known[:, joint]):
        kept = band(data[run])
        if len(kept) > noise.ar.shape[1]:
            white, phi = noise.whiten(kept, joint), noise.whiten(band(tool[run]), joint)
            innovation = white[:, -1] - white[:, :-1] @ coefficients
            row = np.column_stack([phi, innovation + phi @ coefficients])
            turning = band.rows(problem.turning[run, joint])[-len(row) :]
            rows.append(row * noise.weights(innovation, joint, turning)[:, None])
    return rows


def residuals(point: Dynamics, motion: Motion, band: Band = EVERYTHING) -> list[list[Array]]:
    """Current that the point leaves unexplained, joint by joint, run by run [A]."""
    drive = point.drive
    left: list[list[Array]] = [[] for _ in drive.gain]
    for block in blocks(point, motion):
        s = block.bristles.together(drive.presliding_tail)
        error = block.motion.current - point.torque(block.motion, s) / drive.gain
        for j, mine in enumerate(left):
            mine += [band(error[run, j]) for run in runs(block.known[:, j])]
    return left


def turnings(point: Dynamics, motion: Motion, band: Band = EVERYTHING) -> list[list[Mask]]:
    """Which of those rows are near where the joint turns round, joint by joint, run by run."""
    near: list[list[Mask]] = [[] for _ in point.drive.gain]
    for block in blocks(point, motion):
        for j, mine in enumerate(near):
            mine += [band.rows(block.turning[run, j]) for run in runs(block.known[:, j])]
    return near


def absorbed_periodograms(
    point: Dynamics, motion: Motion, covs: Sequence[Array], band: Band = EVERYTHING
) -> list[list[Array]]:
    """Periodograms of noise that a fit absorbed, so that `residuals` lack it, by stretch [A²].

    Args:
        covs: of each joint's coefficients, in the order of `coefficients_at`.
    """
    absorbed: list[list[Array]] = [[] for _ in covs]
    for block in blocks(point, motion):
        problem = design(point, block)
        for j, cov in enumerate(covs):
            columns = problem.columns(j)
            absorbed[j] += [periodogram(band(columns[run]), cov) for run in runs(block.known[:, j])]
    return absorbed
