"""What filters believe, whatever they keep it as: a Gaussian, its root, blocks of it, or points.

Those that are QUICK tell means and standard deviations without more ado; of any other, the filter
is asked for the Gaussian.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np

from urdyn.estimate import Filter
from urdyn.estimate.square_root import SquareRoot
from urdyn.tracking.blocks import BlockBelief
from urdyn.types import Array, Gaussian, Index

S = TypeVar("S")

QUICK = Gaussian | SquareRoot | BlockBelief


def mean(filter_: Filter[S], belief: S) -> Array:
    """Of the states, (n,); a square root need not be squared for it."""
    return belief.mean if isinstance(belief, QUICK) else filter_.belief(belief).mean


def mean_and_sd(filter_: Filter[S], belief: S, at: slice) -> tuple[Array, Array]:
    """Of a few states, (k,) each."""
    known = belief if isinstance(belief, QUICK) else filter_.belief(belief)
    return known.mean[at], known.sd[at]


def marginal(filter_: Filter[S], belief: S, at: Index) -> Gaussian:
    """Belief in a few states; a square root need not be squared for it."""
    if not len(at):
        return Gaussian(np.zeros(0), np.zeros((0, 0)))
    if isinstance(belief, SquareRoot):
        rows = belief.root[at]
        return Gaussian(belief.mean[at], rows @ rows.T)
    if isinstance(belief, BlockBelief):
        few = np.searchsorted(belief.at_bodies, at)
        return Gaussian(belief.mean[at], belief.bodies[np.ix_(few, few)])
    whole = belief if isinstance(belief, Gaussian) else filter_.belief(belief)
    return Gaussian(whole.mean[at], whole.cov[np.ix_(at, at)])


def replaced(belief: S, told: Gaussian) -> S:
    """What is believed by who was told that; particles are not."""
    now: Any = belief
    if isinstance(belief, Gaussian):
        now = told
    elif isinstance(belief, SquareRoot):
        now = SquareRoot.of(told.mean, told.cov)
    elif isinstance(belief, BlockBelief):
        now = belief.with_belief(told)
    return cast(S, now)


def shifted(belief: S, at: slice, by: Array) -> S:
    """The same of states that jumped, (k,); particles find out."""
    if not isinstance(belief, QUICK):
        return belief
    moved = np.array(belief.mean)
    moved[at] += by
    return cast(S, replace(cast(Any, belief), mean=moved))
