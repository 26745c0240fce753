"""Groups of states, one after the other."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate, pairwise


def stacked(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Place of each group among all states, in the order of `sizes`."""
    ends = pairwise(accumulate(sizes.values(), initial=0))
    return {name: slice(*place) for name, place in zip(sizes, ends, strict=True)}
