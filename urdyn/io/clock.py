"""The robot's clock: which stamps can be believed, and where it was set back."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from urdyn.types import Array, Index, Mask

LATEST = 1e11  # [s] the year 5138; what lies beyond is milliseconds, or damage
EPOCH = 1e9  # [s] what is more counts from 1970: no clock has run for thirty years
UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}  # in a second
STEPS = (1.5e-3, 1.5)  # [s] between samples of an arm; three decades, so that one unit fits
DRIFT = 1e-4  # [-] by which two clocks run apart at most
SET = 1.0  # [s] between a step by stamps and by arrival; if larger, a clock was set
STRAY = 20  # rows: a clock that is off for longer did not come from a torn packet
GAP = 5.0  # median steps
PAUSE = 60.0  # [s] that a controller takes to restart, roughly
OFTEN = 20  # times that a recording's clock may be set back; if more, its rows are in no order


def credible(t: Array | float) -> Mask:
    """Stamps that can be seconds at all, (N,)."""
    return np.asarray(np.abs(t) < LATEST)


def finer(t: Array) -> str:
    """Which of UNITS stamps (N,) count, by their steps; "" where most can be seconds, or none fits.

    Since 1970 or since a robot was switched on: nobody has to know.
    """
    t = t[np.isfinite(t)]
    with np.errstate(over="ignore"):  # of damage
        steps = np.abs(np.diff(t))
    if not steps.any() or credible(np.median(t)):
        return ""
    step, (least, most) = np.median(steps[steps > 0.0]), STEPS
    return next((unit for unit, by in UNITS.items() if least <= step / by < most), "")


def dated(t: Array) -> bool:
    """Whether most stamps (N,) are dates, YYYYMMDDhhmmss and perhaps milliseconds.

    A count is seldom within such fields: of a hundred days in a row 31 are possible.
    """
    dates = np.where(t < 1e14, t, t / 1e3)  # without the milliseconds
    dates = dates[(dates >= 1e13) & (dates < 1e14)]
    month_to_second = dates[:, None] // (1e8, 1e6, 1e4, 1e2, 1.0) % 100.0
    possible = (month_to_second >= (1, 1, 0, 0, 0)) & (month_to_second <= (12, 31, 23, 59, 60))
    return bool(2 * np.count_nonzero(possible.all(axis=1)) > len(t))


def elapsed(stamped: Array | float, waited: Array | float) -> Array:
    """Time between samples [s]: by their stamps, or by their arrival where a clock was set."""
    return np.where(np.abs(stamped - waited) > SET, waited, stamped)


def recordings(t: Array) -> list[Mask]:
    """The recordings in one: a mask (n,) of each one's rows that are in order.

    A new one begins where the clock was set back for good; after OFTEN times, the rest is missing.
    """
    parts, told = [t], list[Mask]()
    while parts and len(told) < OFTEN + 2:
        part = parts.pop()
        ordered = _in_order(part)
        back = _set_back(part, ordered)
        if back is None:
            told.append(ordered)
        else:
            parts += [part[back:], part[:back]]
    return told


def pauses(t: Array, first: Index, received: Array) -> Array:
    """Time that passed where the clock was set back, (K,) [s]; PAUSE where unknown.

    However short, it is made a gap: values derived from rows on both sides would belong to neither.

    Args:
        first: rows at which it was, (K,).
        received: when rows arrived, (N,) [s], since 1970 or since a recording began; NaN: unknown.
    """
    with np.errstate(invalid="ignore"):  # infinite stamps give no pause
        waited = received[first] - received[first - 1]
    known = (waited >= 0.0) & (waited < EPOCH)
    return np.where(known, np.maximum(waited, (GAP + 0.5) * np.median(np.diff(t))), PAUSE)


def earlier(t: Array, first: Index, received: Array) -> Mask:
    """Where the clock went back since what follows was recorded earlier, (K,); as for `pauses`.

    A robot's clock that counts from its start and a computer's are not set together.
    """
    with np.errstate(invalid="ignore"):  # infinite stamps tell nothing
        stamped, waited = (x[first] - x[first - 1] for x in (t, received))
        together = (waited < 0.0) & (np.abs(stamped - waited) < SET + DRIFT * np.abs(waited))
    return np.asarray(together & (t[first] < EPOCH) & (received[first] > EPOCH))


def counted_on(t: Array, first: Index, pause: Array) -> Array:
    """Stamps that run on where the clock was set back, (N,).

    Args:
        first: rows at which it was, (K,).
        pause: time that passed there, (K,) [s].
    """
    missed = np.zeros_like(t)
    missed[first] = t[first - 1] + pause - t[first]
    return t + np.cumsum(missed)


def _in_order(t: Array) -> Mask:
    """Rows whose stamps run forward together, (N,); the others strayed, or are another recording.

    Where no stamp runs backwards every row is believed: a far one is a gap.
    """
    if not (np.diff(t) < 0).any():
        return np.ones(len(t), dtype=bool)
    ordered = _near(t)
    ordered[ordered] = _chain(t[ordered])
    for first, stop in _runs(~ordered):
        ordered[first:stop] = not len(_backwards(t, first, stop))
    return ordered


def _set_back(t: Array, ordered: Mask) -> int | None:
    """Row where the clock was set back for good; None: it soon came back wherever it strayed.

    A torn packet strays for a few rows inside a recording. A controller that restarted never
    comes back, so rows that stray at either end, or for long, are another recording.
    """
    for first, stop in _runs(~ordered):
        outside = first == 0 or stop == len(t)
        if stop - first > (1 if outside else STRAY):
            return int(_backwards(t, first, stop)[0])
    return None


def _near(t: Array) -> Mask:
    """Rows whose stamp is near those of the rows before or those of the rows after, (N,).

    Of 2 STRAY + 1 rows most are right, so their median is; a torn packet is far from both sides.
    """
    from scipy.ndimage import median_filter  # heavy, and seldom needed

    half = min(STRAY, (len(t) - 1) // 2)
    median = median_filter(t, 2 * half + 1)
    steps = np.diff(t)
    reach = GAP * (2 * half + 1) * np.median(np.abs(steps[steps != 0]))
    row = np.arange(len(t))
    before, after = (np.clip(row + way, half, len(t) - 1 - half) for way in (-half, half))
    close: Mask = np.minimum(np.abs(t - median[before]), np.abs(t - median[after])) <= reach
    return close


def _chain(t: Array) -> Mask:
    """Rows on the longest chain of stamps that never runs backwards, (N,): patience sorting."""
    tails: list[float] = []  # tails[k] is the smallest stamp that ends a chain of k + 1 rows
    ends: list[int] = []  # and this its row
    before = np.full(len(t), -1)
    for row, stamp in enumerate(t.tolist()):
        k = bisect_right(tails, stamp)
        tails[k : k + 1], ends[k : k + 1] = [stamp], [row]
        before[row] = ends[k - 1] if k else -1
    mask = np.zeros(len(t), dtype=bool)
    row = ends[-1] if ends else -1
    while row >= 0:
        mask[row] = True
        row = int(before[row])
    return mask


def _runs(mask: Mask) -> list[tuple[int, int]]:
    """Half-open stretches where the mask holds."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _backwards(t: Array, first: int, stop: int) -> Index:
    """Rows at which the clock goes back on the way into, through and out of first:stop."""
    start = max(first - 1, 0)
    return np.flatnonzero(np.diff(t[start : stop + 1]) < 0) + start + 1


def leaders(t: Array) -> Index:
    """For every row the first row that has its stamp, (N,); stamps never run backwards here."""
    new = np.concatenate([[True], np.diff(t) > 0])
    leading: Index = np.flatnonzero(new)[np.cumsum(new) - 1]
    return leading


def gaps(t: Array) -> Mask:
    """Rows that come more than GAP median steps after the row before, (N,)."""
    steps = np.diff(t)
    return np.concatenate([[False], steps > GAP * np.median(steps)])
