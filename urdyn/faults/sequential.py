"""The test that keeps a promise: Shiryaev-Roberts over a mixture, an e-detector [Shin2024]_.

Of every stream and cell the state holds R, the sum over all past onsets of the likelihood ratio of
"it began then, and is in this cell now":

    R_t = L(y_t) (R_{t-1} T + entry),      M_t = mean over streams of sum over cells of R_t.

While all streams are healthy E L <= 1, so that M_t - t is a supermartingale however the streams
depend on each other, and the mean time to M >= N is N or more: the threshold is the promise itself.
[Shiryaev1963]_ [Roberts1966]_
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from urdyn.errors import UrdynError
from urdyn.faults.alternatives import Cells, cells
from urdyn.faults.detector import Verdict
from urdyn.faults.mixture import Mixture
from urdyn.types import Array, frozen

MOST = 1e150  # evidence counts no further: an alarm that nobody acknowledges stays finite


@dataclass(frozen=True, eq=False)
class Onsets:
    """Evidence gathered so far."""

    R: Array  # (n, H) [steps]

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", frozen(self.R))


@dataclass(frozen=True, eq=False)
class ShiryaevRoberts:
    """At most one false alarm in `promise` steps over all streams, for standardised innovations.

    Healthy innovations have a conditional mean of at most `tolerance` and a spread of at most one;
    `Whitened` makes such of raw ones.
    """

    promise: float = 10_000.0  # [steps] to a false alarm, at least, on the average
    alternatives: Cells = field(default_factory=cells)
    side: Array | float = 0.0  # (n,) or one for all: +1 only a rise matters, -1 a fall, 0 both
    tolerance: Array | float = 0.0  # (n,) or one [sd]: a change of the mean that is none

    def __post_init__(self) -> None:
        require_promise(self.promise)

    @cached_property
    def _mixture(self) -> Mixture:
        return Mixture(self.alternatives, self.side, self.tolerance)

    def init(self, streams: int) -> Onsets:
        """Nothing seen yet."""
        return Onsets(np.zeros((streams, len(self.alternatives))))

    def step(self, state: Onsets, observed: Array) -> tuple[Onsets, Verdict]:
        """Weigh every cell by the innovations, (n,) [sd], NaN where there is none."""
        cell = self.alternatives
        R = cell.stay * state.R
        R += self._mixture.entry
        R[:, 1:] += cell.move[1:] * state.R[:, :-1]
        R *= self._mixture.likelihood(observed)
        np.minimum(R, MOST, out=R)
        R = self._mixture.unless_missing(R, state.R, observed)
        streams = R.sum(axis=1) / (self.promise * len(R))
        kind, age = self._mixture.explanation(R[streams.argmax()])
        return Onsets(R), Verdict(float(streams.sum()), streams, kind, age)

    def acknowledged(self, state: Onsets) -> Onsets:
        """Nothing seen yet."""
        return replace(state, R=np.zeros_like(state.R))


def require_promise(promise: float) -> None:
    """UrdynError where `promise` is no number of steps."""
    if not promise >= 1.0 or not np.isfinite(promise):
        raise UrdynError(f"promise {promise}: state the steps to a false alarm, 1 or more")


def promised_steps(hours: float, rate: float) -> float:
    """Promise in steps of "one false alarm in so many hours" at `rate` steps a second [Hz]."""
    return hours * 3600.0 * rate
