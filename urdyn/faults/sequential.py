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
from urdyn.faults.alternatives import CLIP, Cells, cells
from urdyn.faults.detector import Verdict
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
        for name in ("side", "tolerance"):
            object.__setattr__(self, name, frozen(np.atleast_1d(getattr(self, name))))
        if not (np.isfinite(self.tolerance).all() and (np.asarray(self.tolerance) >= 0.0).all()):
            raise UrdynError("a tolerance is a finite number of standard deviations, 0 or more")

    @cached_property
    def _entry(self) -> Array:
        """(n or 1, H): the weight of a side that does not matter goes to the other."""
        cell = self.alternatives
        wanted = np.asarray(self.side)[:, None] * cell.side >= 0.0
        entry = np.where(wanted, cell.entry, 0.0)
        return np.asarray(entry / entry.sum(axis=1, keepdims=True))

    @cached_property
    def _gather(self) -> Array:
        """(3, H) tilts, each in the row of what it tilts: the rise, the fall, the square."""
        cell = self.alternatives
        return np.array([np.where(cell.side == side, cell.tilt, 0.0) for side in (1.0, -1.0, 0.0)])

    def init(self, streams: int) -> Onsets:
        """Nothing seen yet."""
        return Onsets(np.zeros((streams, len(self.alternatives))))

    def step(self, state: Onsets, observed: Array) -> tuple[Onsets, Verdict]:
        """Weigh every cell by the innovations, (n,) [sd], NaN where there is none."""
        cell = self.alternatives
        R = cell.stay * state.R + self._entry
        R[:, 1:] += cell.move[1:] * state.R[:, :-1]
        measured = np.isfinite(observed)
        exponent = self._features(np.where(measured, observed, 0.0)) @ self._gather
        exponent -= cell.psi
        R *= np.exp(exponent)
        if not measured.all():
            R[~measured] = state.R[~measured]
        np.minimum(R, MOST, out=R)
        return Onsets(R), self._verdict(R)

    def acknowledged(self, state: Onsets) -> Onsets:
        """Nothing seen yet."""
        return replace(state, R=np.zeros_like(state.R))

    def _features(self, e: Array) -> Array:
        """What may grow, (n, 3): the rise, the fall, the square; each beyond the tolerance."""
        slack = np.asarray(self.tolerance)
        grown = np.column_stack([e - slack, -e - slack, np.abs(e) - slack])
        grown[:, 2] = np.maximum(grown[:, 2], 0.0)
        np.clip(grown, -CLIP, CLIP, out=grown)
        grown[:, 2] **= 2
        return grown

    def _verdict(self, R: Array) -> Verdict:
        streams = R.sum(axis=1) / (self.promise * len(R))
        leading = R[streams.argmax()]
        cell = self.alternatives
        best = cell.kind == cell.kind[leading.argmax()]
        weight = np.where(best, leading, 0.0)
        total = weight.sum()
        age = float(weight @ np.nan_to_num(cell.age) / total) if total > 0.0 else np.nan
        lasting = bool(np.isnan(cell.age[best]).any())
        kind = cell.kinds[int(cell.kind[leading.argmax()])] if total > 0.0 else ""
        return Verdict(float(streams.sum()), streams, kind, np.nan if lasting else age)


def require_promise(promise: float) -> None:
    """UrdynError where `promise` is no number of steps."""
    if not promise >= 1.0 or not np.isfinite(promise):
        raise UrdynError(f"promise {promise}: state the steps to a false alarm, 1 or more")


def promised_steps(hours: float, rate: float) -> float:
    """Promise in steps of "one false alarm in so many hours" at `rate` steps a second [Hz]."""
    return hours * 3600.0 * rate
