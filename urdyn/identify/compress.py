"""All of a log's information in small matrices: whitened, weighted, QR-compressed."""

from __future__ import annotations

import numpy as np

from urdyn.identify.design import Design, coefficients_at, designs
from urdyn.identify.map_estimate import Block
from urdyn.identify.noise import Noise, whiten
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array, Motion

def compress(
    point: Dynamics, motion: Motion, noise: Noise, payload: int | None = None
) -> list[Block]:
    """One block a joint, as long as it has columns, however long the motion was.

    Args:
        point: where the columns are taken; its prediction tells outliers from data.
        noise: colour, scale and tails of the current.
        payload: what the blocks are to say of the payload that `point` carries.
    """
    coefficients = coefficients_at(point)
    R = [np.zeros((0, len(w) + 1)) for w in coefficients]
    for design in designs(point, motion):
        for j, w in enumerate(coefficients):
            R[j] = np.linalg.qr(np.vstack([R[j], *weighted(design, j, noise, w)]), mode="r")
    return [Block(j, payload, R[j]) for j in range(len(R))]


def weighted(design: Design, joint: int, noise: Noise, coefficients: Array) -> list[Array]:
    """Rows [Phi | i] of unit, white, Gaussian-equivalent noise, stretch by stretch."""
    ar, rows = noise.ar[joint], []
    for columns, current in design.stretches(joint):
        if len(current) > len(ar):
            white = whiten(np.column_stack([columns, current]), ar)
            innovation = white[:, -1] - white[:, :-1] @ coefficients
            rows.append(white * noise.weights(innovation, joint)[:, None])
    return rows


def residuals(point: Dynamics, motion: Motion) -> list[list[Array]]:
    """Current that the point leaves unexplained, joint by joint, stretch by stretch [A]."""
    coefficients = coefficients_at(point)
    left: list[list[Array]] = [[] for _ in coefficients]
    for design in designs(point, motion):
        for j, w in enumerate(coefficients):
            left[j] += [current - columns @ w for columns, current in design.stretches(j)]
    return left
