"""Learning a model from history: by EM, or by the marginal likelihood directly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from urdyn.dbn.smoothed import Smoothed
from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.ekf import EKF
from urdyn.estimate.protocol import track
from urdyn.estimate.smoother import smooth
from urdyn.given import given, given_count, given_number, not_negative, positive
from urdyn.types import Array

Setting = TypeVar("Setting")

FIRST_STEP = 0.02  # first differences, relative to a parameter's scale
NEARLY = 0.1  # [nats] below the maximum, within which a search may have ended
FAR, NEAR = 0.5, 0.1  # [scale] size of a search's first simplex; of later ones
CLOSE = 1e-3  # in a parameter and [nats]: size of the simplex at which it ends
SEARCHES = 20  # at most, each from the end of the one before


@dataclass(frozen=True, eq=False)
class Learnt(Generic[Setting]):
    """What fits a history best, and how well."""

    setting: Setting  # a network, noise levels: whatever the model is built from
    log_likelihood: Array  # (rounds,) at the start of each
    converged: bool  # whether it ended because no more was to be gained


def expectation_maximisation(
    start: Setting,
    build: Callable[[Setting], TwoSlice[U]],
    maximise: Callable[[Setting, Smoothed], Setting],
    inputs: Sequence[U],
    observations: Array,
    iterations: int = 50,
    tolerance: float = 1e-4,
) -> Learnt[Setting]:
    """Smooth with the current setting, re-estimate it from that, and repeat [Shumway1982]_.

    Converged when a round raises the log-likelihood by less than `tolerance` [nats]; not if stopped
    after `iterations`. Where readings hold little information on the setting, steps are short: a
    round that gains little may have far to go. The likelihood never falls where `maximise` does
    maximise; if it falls, the previous round's start is returned, not converged if the fall exceeds
    `tolerance`.

    Raises:
        InputError: there is no round, or a tolerance below 0.
    """
    iterations = given_count(iterations, "iterations")
    given_number(tolerance, "tolerance", "a finite number, 0 or more", not_negative)
    before, setting, climbed, gained = start, start, [-np.inf], np.inf
    for _ in range(iterations):
        history, log_likelihood = smooth(build(setting), inputs, observations)
        gained = log_likelihood - climbed[-1]
        if gained < 0.0:
            setting = before
            break
        climbed.append(log_likelihood)
        if gained < tolerance:
            break
        before, setting = setting, maximise(setting, history)
    return Learnt(setting, np.array(climbed[1:]), abs(gained) < tolerance)


def maximise_evidence(
    start: Array,
    build: Callable[[Array], TwoSlice[U]],
    inputs: Sequence[U],
    observations: Array,
    scale: Array | float = 1.0,
) -> Learnt[Array]:
    """Maximum-likelihood parameters, (p,), by Nelder and Mead's simplex.

    For parameters without an EM formula: time constants, a few noise levels (give their
    logarithms). A simplex may collapse on a slope, so a new one starts where it ends, until that
    gains nothing.

    Args:
        scale: typical change of each parameter, (p,) or one for all, such as 1 for a logarithm or a
            coefficient. The first simplex is half as large, wherever it starts.

    Raises:
        InputError: the search did not end, or ended where there is no likelihood; a scale is not
            above 0.
    """
    from scipy.optimize import minimize

    evidence = _evidence(build, inputs, observations)

    def misfit(parameters: Array) -> float:
        try:
            return -evidence(parameters)
        except InputError:  # no belief exists there: the search turns back
            return np.inf

    at = given(start, "start")
    unit = _units(scale, at)
    climbed, reach = [evidence(at)], FAR
    for _ in range(SEARCHES):
        corners = np.vstack([at, at + reach * np.diag(unit)])
        found = minimize(
            lambda z: misfit(z * unit),
            at / unit,
            method="Nelder-Mead",
            options={"xatol": CLOSE, "fatol": CLOSE, "initial_simplex": corners / unit},
        )
        if not (found.success and np.isfinite(found.fun)):
            raise InputError(f"no likeliest setting was found, begin nearer to it: {found.message}")
        at, reach = found.x * unit, NEAR
        climbed.append(-float(found.fun))
        if climbed[-1] - climbed[-2] < CLOSE:
            break
    return Learnt(at, np.array(climbed), climbed[-1] - climbed[-2] < CLOSE)


def parameter_cov(
    at: Array,
    build: Callable[[Array], TwoSlice[U]],
    inputs: Sequence[U],
    observations: Array,
    scale: Array | float = 1.0,
) -> Array:
    """Covariance of the maximum-likelihood parameters (p,), (p, p).

    The inverse of the observed information [Efron1978]_: the log-likelihood's negative curvature,
    by differences over half a standard deviation.

    Args:
        scale: as in `maximise_evidence`; the first differences are over a fiftieth of it.

    Raises:
        InputError: the likelihood does not fall in all directions: this is no maximum, or the data
            do not determine some parameter; a scale is not above 0.
    """
    evidence, at = _evidence(build, inputs, observations), given(at, "at")
    p = len(at)
    step, top = FIRST_STEP * _units(scale, at), evidence(at)
    for _ in range(2):  # the second time with suitable steps
        sides = np.array([[evidence(at + way), evidence(at - way)] for way in np.diag(step)])
        bend = (2.0 * top - sides.sum(axis=1)) / step**2
        falls = (bend > 0.0) & (sides.max(axis=1) < top + NEARLY)
        if not falls.all():
            flat = ", ".join(map(str, np.flatnonzero(~falls)))
            raise InputError(f"the likelihood does not fall beside parameter {flat}: no maximum")
        step = 0.5 / np.sqrt(bend)
    ways, information = np.diag(step), np.diag(bend)
    for i in range(p):
        for j in range(i):
            corners = [
                a * b * evidence(at + a * ways[i] + b * ways[j]) for a in (1, -1) for b in (1, -1)
            ]
            information[i, j] = information[j, i] = -sum(corners) / (4.0 * step[i] * step[j])
    if np.linalg.eigvalsh(information)[0] <= 0.0:
        raise InputError("the likelihood does not fall in all directions: no maximum")
    return np.asarray(np.linalg.inv(information))


def _units(scale: Array | float, at: Array) -> Array:
    """Typical change of each parameter, (p,)."""
    return np.broadcast_to(given(scale, "scale", "numbers above 0", positive), at.shape)


def _evidence(
    build: Callable[[Array], TwoSlice[U]], inputs: Sequence[U], observations: Array
) -> Callable[[Array], float]:
    """Log-likelihood of the observations as a function of parameters (p,)."""

    def evidence(parameters: Array) -> float:
        return track(EKF(), build(parameters), inputs, observations).log_likelihood

    return evidence
