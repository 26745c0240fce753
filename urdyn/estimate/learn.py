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

FIRST_STEP = 0.02  # of the scale of a parameter, of the first differences
NEARLY = 0.1  # [nats] below the top, where a search may have ended
FAR, NEAR = 0.5, 0.1  # of a logarithm or a coefficient, by which a search looks around; and again
CLOSE = 1e-3  # in a parameter and [nats], within which all corners of a simplex are where it ends
SEARCHES = 20  # at most, each from where the one before ended


@dataclass(frozen=True, eq=False)
class Learnt(Generic[Setting]):
    """What fits a history best, and how well."""

    setting: Setting  # a network, noise levels: whatever the model is built from
    log_likelihood: Array  # (rounds,) of what each began with
    converged: bool  # whether it ended for nothing more was to be gained, not for lack of rounds


def expectation_maximisation(
    start: Setting,
    build: Callable[[Setting], TwoSlice[U]],
    maximise: Callable[[Setting, Smoothed], Setting],
    inputs: Sequence[U],
    observations: Array,
    iterations: int = 50,
    tolerance: float = 1e-4,
) -> Learnt[Setting]:
    """Smooth with what is believed, learn from that, and again [Shumway1982]_.

    Ends when a round raises the log-likelihood by less than `tolerance` [nats], and so has
    converged, or after `iterations`, and has not. Where readings tell little of what is learnt its
    rounds are short: one that gains little may have far to go. The likelihood never falls where
    `maximise` does what its name says; where it does fall, what the round before began with is
    returned, and that has not converged where the fall is of more than `tolerance`.

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
    """The parameters, (p,), that make the observations likeliest, by Nelder and Mead's simplex.

    For what EM has no formula for: time constants, a few noise levels (give their logarithms). A
    simplex may collapse on a slope, so it is opened anew where one ends, until that gains nothing.

    Args:
        scale: (p,), or one for all: what is a fair change of each parameter, as 1 is of a logarithm
            or a coefficient. The first simplex is half as large, wherever it starts.

    Raises:
        InputError: the search did not end, or led to where there is no likelihood; a scale is not
            above 0.
    """
    from scipy.optimize import minimize

    evidence = _evidence(build, inputs, observations)

    def misfit(parameters: Array) -> float:
        try:
            return -evidence(parameters)
        except InputError:  # no belief is possible there: the search turns back
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
    """Covariance of parameters (p,) that make the observations likeliest, (p, p).

    The inverse of the observed information [Efron1978]_: how the log-likelihood bends there, by
    differences over half a standard deviation.

    Args:
        scale: that of `maximise_evidence`; the first differences are over a fiftieth of it.

    Raises:
        InputError: it does not fall in all directions: this is no maximum, or nothing tells of
            some parameter; a scale is not above 0.
    """
    evidence, at = _evidence(build, inputs, observations), given(at, "at")
    p = len(at)
    step, top = FIRST_STEP * _units(scale, at), evidence(at)
    for _ in range(2):  # the second time by steps that suit
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
    """A fair change of each parameter, (p,)."""
    return np.broadcast_to(given(scale, "scale", "numbers above 0", positive), at.shape)


def _evidence(
    build: Callable[[Array], TwoSlice[U]], inputs: Sequence[U], observations: Array
) -> Callable[[Array], float]:
    """Log-likelihood of the observations by parameters (p,)."""

    def evidence(parameters: Array) -> float:
        return track(EKF(), build(parameters), inputs, observations).log_likelihood

    return evidence
