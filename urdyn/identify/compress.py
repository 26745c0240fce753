"""A log's whole information in small matrices: whitened, weighted, QR-compressed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.identify.band import EVERYTHING, Band
from urdyn.identify.design import Block, Design, blocks, coefficients_at, design, runs
from urdyn.identify.map_estimate import Compressed
from urdyn.identify.noise import Noise
from urdyn.identify.slow import periodogram
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array, Mask, Motion

PIECE = 1024  # rows of one QR


def compress(
    point: Dynamics,
    motion: Motion,
    noise: Noise,
    payload: int | None = None,
    band: Band = EVERYTHING,
) -> list[Compressed]:
    """One small problem per joint, of a size given by its columns, however long the motion.

    Args:
        point: where the columns are linearised; outliers are judged by its prediction.
        noise: colour, scale and tails of the current.
        payload: index of the payload that `point` carries; None: none.
        band: the band in which currents are compared.
    """
    coefficients = coefficients_at(point)
    R = [np.zeros((0, len(w) + 1)) for w in coefficients]
    for block in blocks(point, motion):
        instrument, left = design(point, block.instrumental), unexplained(point, block)
        for j, w in enumerate(coefficients):
            R[j] = _triangle([R[j], *_weighted(instrument, left[:, j], j, noise, w, band)])
    return [Compressed(j, payload, triangle) for j, triangle in enumerate(R)]


def _triangle(parts: Sequence[Array]) -> Array:
    """R of rows (n, c), by QR of pieces that fit into the cache: (c, c), or (n, c) if n < c."""
    rows = np.vstack(parts)
    R = rows[:0]
    for start in range(0, len(rows), PIECE):
        R = np.asarray(np.linalg.qr(np.vstack([R, rows[start : start + PIECE]]), mode="r"))
    return R


def _weighted(
    instrument: Design, left: Array, joint: int, noise: Noise, coefficients: Array, band: Band
) -> list[Array]:
    """Rows [Phi | i] of unit, white, Gaussian-equivalent noise, run by run.

    Phi is the instrument's, and i is such that its residual at the point is that of the measured
    motion, `left`: acceleration noise is in only one of the two, and does not bias the fit.
    [Soderstrom2002]_
    """
    rows, columns = [], np.column_stack([instrument.columns(joint), left])
    for run in runs(instrument.known[:, joint]):
        kept = band(columns[run])
        if len(kept) > noise.ar.shape[1]:
            white = noise.whiten(kept, joint)
            phi, innovation = white[:, :-1], white[:, -1]
            turning = band.rows(instrument.turning[run, joint])[-len(white) :]
            row = np.column_stack([phi, innovation + phi @ coefficients])
            rows.append(row * noise.weights(innovation, joint, turning)[:, None])
    return rows


def unexplained(point: Dynamics, block: Block) -> Array:
    """Current of a block that the point leaves unexplained, (N, J) [A]."""
    s = block.bristles.together(point.drive.presliding_tail)
    return np.asarray(block.motion.current - point.torque(block.motion, s) / point.drive.gain)


def residuals(point: Dynamics, motion: Motion, band: Band = EVERYTHING) -> list[list[Array]]:
    """Current that the point leaves unexplained, joint by joint, run by run [A]."""
    left: list[list[Array]] = [[] for _ in point.drive.gain]
    for block in blocks(point, motion):
        error = unexplained(point, block)
        for j, mine in enumerate(left):
            mine += [band(error[run, j]) for run in runs(block.known[:, j])]
    return left


def turnings(point: Dynamics, motion: Motion, band: Band) -> list[list[Mask]]:
    """Which of those rows are near a reversal of the joint, joint by joint, run by run."""
    near: list[list[Mask]] = [[] for _ in point.drive.gain]
    for block in blocks(point, motion):
        for j, mine in enumerate(near):
            mine += [band.rows(block.turning[run, j]) for run in runs(block.known[:, j])]
    return near


def absorbed_periodograms(
    point: Dynamics, motion: Motion, roots: Sequence[Array], band: Band = EVERYTHING
) -> list[list[Array]]:
    """Periodograms of noise that a fit absorbed, and `residuals` lack, by stretch [A²].

    Args:
        roots: L of each joint's coefficients, in the order of `coefficients_at`: their covariance
            is L Lᵀ.
    """
    absorbed: list[list[Array]] = [[] for _ in roots]
    for block in blocks(point, motion):
        problem = design(point, block)
        for j, L in enumerate(roots):
            columns = problem.columns(j)
            modes = (band(columns[run] @ L) for run in runs(block.known[:, j]))
            absorbed[j] += [periodogram(each).sum(axis=1) for each in modes]
    return absorbed
