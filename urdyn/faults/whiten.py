"""A learnt healthy baseline: level, colour and spread of each stream, robust to outliers.

    e_t = (y_t - sum_k a_k y_{t-k} - c) / (kappa s)

with a the autoregression, c and s the level and spread of its residuals and kappa the inflation:
healthy innovations are white, and a little narrower than a standard normal once they are clipped.
Nothing is filtered: a filter colours the noise that a likelihood needs white. Units are [spread],
which is s, and [sd], kappa s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from urdyn.errors import InputError
from urdyn.faults.alternatives import CLIP
from urdyn.faults.autoregression import autoregression, complete, lagged
from urdyn.faults.gaps import Bridge, bridged
from urdyn.faults.robust import level_and_spread, long_run_excess, restlessness
from urdyn.given import given, given_a, given_number, given_rows, positive
from urdyn.types import Array, freeze

ENOUGH = 1000  # steps from which a baseline is known well
LEAST = 100  # fewest measured steps to learn one from
INFLATION = 1.04  # [-] kappa of a baseline of ENOUGH steps
STRONGEST = 0.995  # [-] largest sum of coefficients accepted from a short baseline
ROUNDS = 3  # of levels across gaps; each more than halves their error


@dataclass(frozen=True, eq=False)
class Baseline:
    """Healthy streams."""

    coefficients: Array  # (n, p) a, the newest lag first
    level: Array  # (n,) c [unit]
    spread: Array  # (n,) s [unit]
    inflation: Array  # (n,) kappa [-]
    typical: Array  # (n,) [unit] level of the stream itself
    stride: Array  # (n,) [sd] of differences of successive innovations, over sqrt(2)
    pace: Array  # (n,) steps between judged values: closer ones were never seen
    seen: Array  # (N, n) [spread] innovations that it was learnt from; NaN where none
    steps: Array  # (n,) measured steps that it was learnt from

    def __post_init__(self) -> None:
        freeze(self)
        assert self.coefficients.shape[:1] == self.level.shape == self.spread.shape

    @property
    def streams(self) -> int:
        """Number of streams."""
        return len(self.level)

    @property
    def healthy(self) -> Array:
        """Innovations that it was learnt from, (N, n) [sd]; NaN where none."""
        return np.asarray(self.seen / self.inflation)

    @property
    def order(self) -> int:
        """Lags."""
        return int(self.coefficients.shape[1])

    def whitened(self, change: Array | float) -> Array:
        """Lasting change of each stream [unit] -> of its innovations' mean [sd], (n,)."""
        passed = 1.0 - self.coefficients.sum(axis=1)
        return np.asarray(change * np.abs(passed) / (self.inflation * self.spread))

    @cached_property
    def bridge(self) -> Bridge:
        """Predictor from the last steps, whichever of them are missing."""
        return Bridge(self.coefficients, self.level, self.typical, self.pace)

    def innovations(self, series: Array) -> Array:
        """Innovations of a series (N, n) without a past: NaN in the first p steps."""
        return bridged(self.bridge, series) / (self.inflation * self.spread)


def learn_baseline(healthy: ArrayLike, inflation: float = INFLATION) -> Baseline:
    """Baseline of a healthy series (N, n) or (N,) of ENOUGH steps or more.

    The data choose the order of each autoregression, also where rows are missing. Remaining colour,
    a changing spread and a shorter baseline raise the inflation.

    Raises:
        InputError: too few steps are measured, or a stream does not move at all.
    """
    series = given_rows(healthy, "a baseline")
    _not_less_than_noise(inflation)
    typical = np.array([level_and_spread(measured(y, i))[0] for i, y in enumerate(series.T)])
    found = [autoregression(y - middle) for y, middle in zip(series.T, typical, strict=True)]
    known = np.isfinite(series).sum(axis=0).tolist()
    found = [(_as_strong(a, n), pace) for (a, pace), n in zip(found, known, strict=True)]
    coefficients = np.zeros((len(found), max(len(a) for a, _ in found)))
    for row, (a, _) in zip(coefficients, found, strict=True):
        row[: len(a)] = a
    pace = np.array([float(steps) for _, steps in found])
    level = typical * (1.0 - coefficients.sum(axis=1))
    left = _left(series, found, Bridge(coefficients, level, typical, pace))
    learnt = [_stream(series[:, i], left[:, i], i, a, inflation) for i, (a, _) in enumerate(found)]
    level, spread, kappa, stride = np.array(learnt).T
    seen = (left - level) / spread
    return Baseline(
        coefficients=coefficients,
        level=level,
        spread=spread,
        inflation=kappa,
        typical=typical,
        stride=stride,
        pace=pace,
        seen=seen,
        steps=np.array(known),
    )


def stated_baseline(
    level: Array | float, sd: Array | float, inflation: float = INFLATION
) -> Baseline:
    """Healthy streams that are white with a level and a spread known beforehand, (n,) [unit]."""
    _not_less_than_noise(inflation)
    n = max(np.size(level), np.size(sd))
    centre = given(level, "level", streams=n)
    spread = given(sd, "sd", "positive numbers", positive, n)
    one = np.ones(n)
    return Baseline(
        coefficients=np.zeros((n, 0)),
        level=centre,
        spread=spread,
        inflation=np.full(n, inflation),
        typical=centre,
        stride=one,
        pace=one,
        seen=np.zeros((0, n)),
        steps=np.full(n, ENOUGH),
    )


def given_baseline(baseline: object) -> Baseline:
    """A learnt or stated baseline; InputError where it is something else."""
    return given_a(baseline, Baseline, "baseline", "as learn_baseline or stated_baseline gives")


def _not_less_than_noise(inflation: object) -> None:
    """InputError where innovations would be wider than a standard normal: no promise holds then."""
    given_number(inflation, "inflation", "a number, 1 or more", lambda x: x >= 1.0)


def beside(series: ArrayLike, baseline: Baseline | ArrayLike) -> tuple[Array, Baseline]:
    """A series (N, n), and its baseline: given, or learnt from the same streams."""
    rows = given_rows(series, "a series")
    healthy = baseline if isinstance(baseline, Baseline) else learn_baseline(baseline)
    if rows.shape[1] != healthy.streams:
        raise InputError(
            f"the series is {rows.shape}, and the baseline has {healthy.streams} streams: "
            "give steps x streams of the same streams"
        )
    return rows, healthy


def measured(y: Array, stream: int) -> Array:
    """Measured values of one stream of a baseline, (N,); InputError where they are too few."""
    known = y[np.isfinite(y)]
    if len(known) < LEAST:
        raise InputError(
            f"stream {stream} of the baseline has {len(known)} measured steps, {LEAST} are needed "
            f"and {ENOUGH} are good; record longer"
        )
    return known


def _as_strong(a: Array, steps: int) -> Array:
    """Coefficients whose sum A is biased low, by (1 + 3 A) / N, no more than from ENOUGH steps.

    [Kendall1954]_
    """
    total, short = float(a.sum()), max(0.0, 1.0 / steps - 1.0 / ENOUGH)
    if not short or not total > 0.0:
        return a
    return a * max(1.0, min(total + (1.0 + 3.0 * total) * short, STRONGEST) / total)


def _doubt(a: Array, steps: int) -> float:
    """Relative error of 1 - A, A their sum, which scales a lasting sum of innovations.

    sqrt((1 + A) / (1 - A) / N), beyond its value at ENOUGH steps.
    """
    if not len(a):
        return 0.0
    total = float(np.clip(a.sum(), 0.0, STRONGEST))
    short = max(0.0, 1.0 / np.sqrt(steps) - 1.0 / np.sqrt(ENOUGH))
    return float(np.sqrt((1.0 + total) / (1.0 - total)) * short)


def _left(series: Array, found: list[tuple[Array, int]], start: Bridge) -> Array:
    """Residuals of the autoregressions, (N, n), including their level; NaN where there is none."""
    gaps = np.asarray(~np.isfinite(series).all(axis=0))
    left = np.empty_like(series)
    for i in np.flatnonzero(~gaps):
        a, _ = found[i]
        past = lagged(series[:, i : i + 1], len(a))[:, :, 0]
        left[:, i] = series[:, i] - np.einsum("p,Np->N", a, past)
    if gaps.any():
        left[:, gaps] = _left_across_gaps(series[:, gaps], start.of(gaps))
    return left


def _left_across_gaps(series: Array, bridge: Bridge) -> Array:
    """The same of streams with gaps, across which predictions use a level found in ROUNDS."""
    for _ in range(ROUNDS):
        e = bridged(bridge, series)
        moved = [level_and_spread(x[np.isfinite(x)])[0] for x in e.T]
        bridge = replace(bridge, level=bridge.level + moved)
    return bridged(bridge, series) + bridge.level


def _stream(
    y: Array, left: Array, stream: int, a: Array, inflation: float
) -> tuple[float, float, float, float]:
    """Level, spread, inflation and stride of one stream, (N,), from its residuals, (N,)."""
    known = left[np.isfinite(left)]
    level, spread = level_and_spread(known)
    if not spread > 0.0:
        raise InputError(f"stream {stream} of the baseline does not move: it cannot be judged")
    white = np.clip((known - level) / spread, -CLIP, CLIP)
    short = np.sqrt(max(1.0, ENOUGH / complete(y, a)))
    _, stride = level_and_spread(np.diff(known) / (np.sqrt(2.0) * spread))
    # A difference of long-tailed innovations is less long-tailed than they: stride is above 1, and
    # innovations at the clip follow each other more often than a normal's would.
    tails = max(1.0, stride)
    # The promise was tested with inflations that take colour as wholly learnt without gaps.
    left_over = 1.0 if len(a) and np.isfinite(y).all() else long_run_excess(white)
    kappa = (1.0 + (inflation - 1.0) * short) * np.sqrt(left_over * tails)
    kappa *= np.sqrt(restlessness(white)) * (1.0 + _doubt(a, int(np.isfinite(y).sum())))
    return level, spread, float(kappa), stride
