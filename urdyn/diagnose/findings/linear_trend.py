"""A straight line through sizes of uncertain noise, an unknown part of which wanders.

    y = level + rate min(t, end) + scale (sd e + wander W(t))

with e white, W a random walk over the observed time, and end 0 for a line that goes on. An error
common to all y is in the level and not in the rate. Scale and wander are weighted by how well they
explain y; where y are few, their stated sd counts most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array

SAID = 4.0  # weight of the stated sd, in sizes
WANDER = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # [sd of y] from first to last
LATEST = 20  # sizes used one by one: they show what has just happened
MEANS = 20  # of neighbours, at most, that represent all earlier sizes


@dataclass(frozen=True)
class LinearTrend:
    """The line's level at t = 0, and its rate."""

    level: float
    level_sd: float  # without the error that all y share
    rate: float  # [1/s]
    rate_sd: float
    ended: float  # chi² by which a line that ended earlier fits better


def linear_trend(t: Array, y: Array, sd: Array) -> LinearTrend:
    """The line through y (N,) at t (N,) [s], four or more, the last one before 0.

    Args:
        sd: of y, (N,); may include the error that they share.
    """
    usual = float(1.0 / np.mean(sd**-2.0))
    t, y, var = _means(t, y, sd)
    root = _root(t, var, usual)
    ramps = np.minimum(t[:, None], np.append(0.0, t[1:-1]))  # (n, e) by ends; the first goes on
    columns = np.column_stack([np.ones_like(t), y, ramps])
    white = np.linalg.solve(root, columns[None])  # (w, n, 2 + e), by how much wanders
    one, rest = white[..., :1], white[..., 1:]
    mass = np.sum(one**2, axis=1)  # (w, 1)
    mean = np.sum(one * rest, axis=1) / mass
    rest = rest - one * mean[:, None]
    square = np.sum(rest[..., 1:] ** 2, axis=1)  # (w, e)
    rate = np.sum(rest[..., :1] * rest[..., 1:], axis=1) / square
    misses = SAID + np.sum(rest[..., 0] ** 2, axis=1)[:, None] - rate**2 * square
    spread = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)[:, None]
    # log-likelihood of each, level and scale marginalised; in `weight` the rate as well
    told = -spread - 0.5 * np.log(mass) - 0.5 * (SAID + len(t) - 2.0) * np.log(misses)
    scale = misses[:, 0] / (SAID + len(t) - 4.0)  # mean of its square
    weight = told[:, 0] - 0.5 * np.log(square[:, 0])
    weight = np.exp(weight - weight.max())
    level = mean[:, 0] - rate[:, 0] * mean[:, 1]
    var_level = scale * (1.0 / mass[:, 0] + mean[:, 1] ** 2 / square[:, 0])
    return LinearTrend(
        *_mixed(weight, level, var_level),
        *_mixed(weight, rate[:, 0], scale / square[:, 0]),
        ended=2.0 * float(told[:, 1:].max() - told[:, 0].max()),
    )


def _root(t: Array, var: Array, usual: float) -> Array:
    """Root of the covariance of a line's residuals, (w, n, n): white noise `var`, and a walk."""
    lasting = (t - t[0]) / (t[-1] - t[0])
    walk = usual * np.minimum.outer(lasting, lasting)
    return np.linalg.cholesky(np.diag(var) + np.multiply.outer(np.square(WANDER), walk))


def _means(t: Array, y: Array, sd: Array) -> tuple[Array, Array, Array]:
    """Times, sizes and variances, averaged over neighbours except for the latest."""
    old = max(len(t) - LATEST, 1)
    at = np.append(np.arange(0, old, -(-old // MEANS)), np.arange(old, len(t)))
    weight = sd**-2.0
    total = np.add.reduceat(weight, at)
    t, y = (np.add.reduceat(weight * of, at) / total for of in (t, y))
    return t, y, 1.0 / total


def _mixed(weight: Array, mean: Array, var: Array) -> tuple[float, float]:
    """Mean and sd of a mixture."""
    weight = weight / weight.sum()
    whole = float(weight @ mean)
    return whole, float(np.sqrt(weight @ (var + (mean - whole) ** 2)))
