"""What filters believe, in any representation: a Gaussian, its root, blocks of it, or points.

QUICK representations hold a mean and standard deviations; for any other, the filter is asked
for a Gaussian.
"""

from __future__ import annotations

import numpy as np

from urdyn.estimate import Filter
from urdyn.estimate.protocol import S, is_gaussian, is_shifting
from urdyn.estimate.square_root import SquareRoot
from urdyn.tracking.belief.blocks import BlockBelief
from urdyn.types import Array, Gaussian, Index

QUICK = Gaussian | SquareRoot | BlockBelief
# What a filter lacks that cannot be given a belief, or cannot even shift states that jumped.
LOAD = "what was known of a load before it changed does not count"
DRIVES = "a drive that wore is not told by what was believed of it before"
NARROW = "its intervals are too narrow where states are many"
ZEROS = "an encoder that jumped is followed slowly"


def mean(filter_: Filter[S], belief: S) -> Array:
    """Mean of the states, (n,); a square root is not squared for it."""
    return belief.mean if isinstance(belief, QUICK) else filter_.belief(belief).mean


def mean_and_sd(filter_: Filter[S], belief: S, at: slice) -> tuple[Array, Array]:
    """Mean and sd of a few states, (k,) each."""
    known = belief if isinstance(belief, QUICK) else filter_.belief(belief)
    return known.mean[at], known.sd[at]


def marginal(filter_: Filter[S], belief: S, at: Index) -> Gaussian:
    """Belief in a few states; a square root is not squared for it."""
    if not len(at):
        return Gaussian(np.zeros(0), np.zeros((0, 0)))
    if isinstance(belief, SquareRoot):
        rows = belief.root[at]
        return Gaussian(belief.mean[at], rows @ rows.T)
    if isinstance(belief, BlockBelief):
        few = np.searchsorted(belief.at_shared, at)
        return Gaussian(belief.mean[at], belief.shared[np.ix_(few, few)])
    whole = belief if isinstance(belief, Gaussian) else filter_.belief(belief)
    return Gaussian(whole.mean[at], whole.cov[np.ix_(at, at)])


def replaced(filter_: Filter[S], belief: S, by: Gaussian) -> S:
    """The filter's belief replaced `by` this one; unchanged where the filter cannot take one."""
    return filter_.with_belief(belief, by) if is_gaussian(filter_) else belief


def shifted(filter_: Filter[S], belief: S, at: slice, by: Array) -> S:
    """The belief once states `at` jumped by (k,); unchanged where the filter cannot shift."""
    if not is_shifting(filter_):
        return belief
    step = np.zeros(len(mean(filter_, belief)))
    step[at] = by
    return filter_.shifted(belief, step)


def lacking(filter_: Filter[S]) -> str:
    """What this filter cannot do that others can, for the user; "": nothing."""
    lacks = [] if is_gaussian(filter_) else [LOAD, DRIVES, NARROW]
    lacks += [] if is_shifting(filter_) else [ZEROS]
    return f"{type(filter_).__name__} keeps no Gaussian: {'; '.join(lacks)}" if lacks else ""
