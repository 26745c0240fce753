"""What recurs in a joint's current at each reversal: play in a gear, whatever its form.

A loop's response to a gap is unknown: a lack, a blow, a rebound, a dither. Its time is known: the
joint's own reversals, of its load, its velocity or its motor's torque, with their sign. So windows
about them, each relative to its own level and slope, are y = d + e, and their mean d may be

    d ~ N(0, recurs² C)  for a sound joint: a model is off there, from day to day and twin to twin
    d ~ N(0, C / k)      for one with play, k in RECURS;      e ~ N(0, C), C as at any other time

which is a test of Hotelling's kind (`recurrence`). The ratios of the last n windows, summed over n,
are the Shiryaev-Roberts sum [Roberts1966]_. One push may reverse a joint several times, which is no
recurrence: only its first window counts.

A window shows play only where a friction model holds throughout: where the joint slides, or
reverses and slides on. There, friction may differ in size, in the bristles' stiffness and in how it
fades with speed: what these explain is not taken for play. Where the joint does not reverse,
effects weaker than the common mean of a sound joint's windows are left out of that explanation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.special import logsumexp

from urdyn.diagnose.fast.recurrence import FEWEST, LATE, aligned, ratios
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.fast_rules import BacklashRule
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.residual.rows import COULOMB, ROTOR, Rows
from urdyn.diagnose.residual.space import Space
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Array, Index, Mask

BIN, BEFORE, AFTER = 0.02, 5, 8  # [s]; bins of a window before and after a reversal
BINS, KEPT = BEFORE + AFTER, slice(BEFORE - 1, BEFORE + 5)  # its middle shows play
FIRM = 3  # bins before and after, by which a joint has reversed
SMOOTH = 3.0 * BIN  # [s] of noise, which is no reversal
SPAN = BIN * AFTER  # [s] after a reversal
PUSHED = 2.0 * BIN  # [s] before a reversal at which a push caused by it may seem to begin
LAST = 32  # reversals kept
SURELY = 0.95  # [-] that play began after the reversal preceding those that may show it
TILE = 0.1  # [s] between the windows that estimate C
KNOWN, MOST = 20.0, 120.0  # separate windows for C: fewer are too few; more are forgotten
BRISK = 4  # bins at most in which a reversing joint is slow
NOTHING = 1e-9  # [-] of friction's effects, relative to the largest
FADES = (0.02, 0.1)  # [rad/s] speeds at which friction may fade otherwise
PATTERN = KEPT.stop - KEPT.start  # p, its bins
MIDDLES = BIN * (np.arange(BINS) + 0.5 - BEFORE)  # [s] of its bins
LEVELS = np.linalg.qr(np.column_stack([np.ones(BINS), MIDDLES]))[0]  # its level and slope
WAYS = ("load", "velocity", "current", "torque")  # quantities that reverse
MODELLED = ("load", "torque")  # those whose reversal time only a model gives


@dataclass(frozen=True, eq=False)
class Recurred:
    """The last windows at reversals, and those at any time."""

    cov: Array  # (J, p, p) [A²] mean of squares at any time
    tiles: Array  # (J,) number of those windows
    y: Array  # (J, WAYS, LAST, LATE, p) [A] the latest last, signed as the reversal; NaN: none
    t: Array  # (J, WAYS, LAST) [s]
    begun: float = np.nan  # [s] the first row processed


def at_first(joints: int) -> Recurred:
    """Nothing seen yet."""
    nan = partial(np.full, fill_value=np.nan)
    cov, shape = np.zeros((joints, PATTERN, PATTERN)), (joints, len(WAYS), LAST)
    return Recurred(cov, np.zeros(joints), nan((*shape, len(LATE), PATTERN)), nan(shape))


@dataclass(frozen=True, eq=False)
class Recurring:
    """Sequential test for what recurs at reversals of one joint."""

    space: Space
    rule: BacklashRule

    def step(
        self,
        state: Recurred,
        rows: Rows,
        load: Array,
        left: Array,
        judged: Mask,
        loud: Array,
        told: Mask,
    ) -> tuple[Recurred, list[Event]]:
        """State after some rows, and events.

        Args:
            load: of joints, (N, J) [N·m].
            left: residuals of their currents, (N, J) [A].
            judged: rows and joints that may be judged, (N, J).
            loud: [s] start and end of what may have been pushes, (n, 2).
            told: joints already reported, (J,).
        """
        found = list[Event]()
        if np.isnan(state.begun):
            state = replace(state, begun=float(rows.t[0]))
        state = self._any_time(state, rows, left, judged)
        for w, of in enumerate((load, rows.v, rows.predicted, self._torque(rows, load))):
            x = self._slowly(rows, of)
            turned = np.zeros(x.shape, dtype=bool)
            turned[1:] = (x[1:] * x[:-1] < 0.0) & judged[1:]
            for row, j in np.argwhere(turned).tolist():
                t0 = rows.zero(x[:, j], row)
                if t0 < _over(float(state.t[j, w, -1]), loud):
                    continue
                late = LATE if WAYS[w] in MODELLED else LATE[:1]
                y = _windows(rows, x[:, j], left[:, j], j, t0 + late, self._least(state, j))
                if not np.isfinite(y[0]).all():
                    continue
                state = _with(state, j, w, y * np.sign(-x[row - 1, j]), t0)
                known = told[j] or any(event.joint == j for event in found)
                event = None if known else self._event(state, j, w, float(rows.t[-1]))
                found += [event] if event else []
        return state, found

    def _torque(self, rows: Rows, load: Array) -> Array:
        """Motor torque including the rotor's inertia, without friction, (N, J) [A]."""
        return load / self.space.reference.drive.gain + rows.drive[:, ROTOR]

    def _slowly(self, rows: Rows, x: Array) -> Array:
        """Rows x (N, J) without noise: means over SMOOTH."""
        many = max(1, round(SMOOTH * (len(rows) - 1) / float(np.ptp(rows.t) or np.inf)))
        return np.asarray(uniform_filter1d(x, many, axis=0))

    def _least(self, state: Recurred, j: int) -> float:
        """Size of the common mean of a sound joint's windows [A]."""
        return float(self.rule.recurs * np.sqrt(np.trace(self._scatter(state, j)) / PATTERN))

    def _scatter(self, state: Recurred, j: int) -> Array:
        """C of joint j (p, p) [A²], at least the model's error where a recording has no noise."""
        drive = self.space.reference.drive
        off = self.rule.foreseen * drive.coulomb[j] / drive.gain[j]
        return np.asarray(state.cov[j] + off**2 * np.eye(PATTERN))

    def _any_time(self, state: Recurred, rows: Rows, left: Array, judged: Mask) -> Recurred:
        """With windows at any time, for joints that move throughout."""
        grid = np.flatnonzero(np.diff(np.floor(rows.t / TILE), prepend=np.inf) > 0.0)
        cov, tiles = state.cov.copy(), state.tiles.copy()
        for row in grid[judged[grid].any(axis=1)].tolist():
            at = _edges(rows.t, float(rows.t[row]))
            if at is None:
                continue
            r, v = _means(left, at), _means(rows.v, at)
            moves = np.abs(v).min(axis=0) > STANDING
            moves &= (np.abs(v.sum(axis=0)) == np.abs(v).sum(axis=0)) & np.isfinite(r).all(axis=0)
            for j in np.flatnonzero(moves & judged[row]).tolist():
                y, most = _apart(r[:, j]), MOST * BINS * BIN / TILE
                tiles[j] += 1.0
                cov[j] += (np.outer(y, y) - cov[j]) / min(tiles[j], most)
        return replace(state, cov=cov, tiles=tiles)

    def _event(self, state: Recurred, j: int, w: int, now: float) -> Event | None:
        """Play of joint j, if its reversals now show it."""
        known = min(state.tiles[j] * TILE / (BINS * BIN), MOST)
        there = np.isfinite(state.t[j, w])
        y, t = state.y[j, w, there], state.t[j, w, there]
        if known < KNOWN or len(y) < FEWEST:
            return None
        sound = self.rule.recurs**-2.0
        cov = self._scatter(state, j)
        y, placed = aligned(y, cov)
        each = ratios(y, known * cov, known + PATTERN + 1.0, sound)
        each = each + placed[FEWEST - 1 :]
        evidence = float(logsumexp(each) - np.log(2.0 * len(WAYS) * self.space.joints))
        if evidence < self.rule.needed:
            return None
        many = int(np.argmax(each)) + FEWEST
        share = np.cumsum(np.exp(each - logsumexp(each)))
        most = int(np.searchsorted(share, SURELY)) + FEWEST
        shape = y[-many:].mean(axis=0)
        half_gap, lasting = self._size(j, shape)
        said = {
            "half_gap_rad": half_gap,
            "reversals": many,
            "recurs_at": WAYS[w],
            "current_A": shape.tolist(),
            "lasting_s": lasting,
            "statistic": evidence,
            "threshold": self.rule.needed,
        }
        return Event(
            kind="joint_backlash",
            joint=j,
            onset=float(t[-many]),
            alarm=now,
            size=half_gap,
            evidence=said,
            unseen=float(np.append(state.begun, t)[-1 - most]),
        )

    def _size(self, j: int, shape: Array) -> tuple[float, float]:
        """Half the gap that a motor would cross in this time [rad], and the time [s].

        T = sqrt(4 b I_r / f), as in `crossing`; what recurs lasts twice as long as its middle.
        """
        drive, t = self.space.reference.drive, (np.arange(PATTERN) - 0.5) * BIN
        lasting = 2.0 * float(np.average(np.maximum(t, 0.0), weights=np.abs(shape)))
        return float(drive.coulomb[j] * lasting**2 / (4.0 * drive.rotor_inertia[j])), lasting


def unjolted(findings: Sequence[Finding], seen: Recurred, coulomb: Array) -> tuple[Finding, ...]:
    """Without pushes that are jolts of a joint with play at its own reversals.

    Args:
        coulomb: friction of the joints, (J,) [N·m], in units of which a push is largest.
    """
    loose = [f.joint for f in findings if f.kind == "joint_backlash"]
    if not loose:  # called every beat, and pushes are many
        return tuple(findings)

    def own(f: Finding) -> bool:
        if f.kind != "collision":
            return False
        j = int(np.argmax(np.abs(f.says.torque) / coulomb))
        after = f.onset_s - seen.t[j]
        return j in loose and bool(((after > -PUSHED) & (after < SPAN)).any())

    return tuple(f for f in findings if not own(f))


def _with(state: Recurred, j: int, w: int, y: Array, t: float) -> Recurred:
    """One more window."""
    windows, times = state.y.copy(), state.t.copy()
    windows[j, w] = np.append(windows[j, w, 1:], y[None], axis=0)
    times[j, w] = np.append(times[j, w, 1:], t)
    return replace(state, y=windows, t=times)


def _over(last: float, loud: Array) -> float:
    """When all that a window at `last` may show is over [s]: a push in it recurs in no other."""
    end = last + SPAN
    return float(np.max(loud[loud[:, 0] < end, 1], initial=end))


def _edges(t: Array, t0: float) -> Index | None:
    """First rows of the bins of a window about t0, and its end, (BINS + 1,); None: incomplete."""
    at = np.searchsorted(t, t0 + BIN * (np.arange(BINS + 1) - BEFORE))
    return np.asarray(at) if (np.diff(at) > 0).all() and at[-1] < len(t) else None


def _means(x: Array, at: Index) -> Array:
    """Means of rows x (N, ...) in bins, (BINS, ...)."""
    many = np.diff(at).reshape(-1, *(1,) * (x.ndim - 1))
    return np.asarray(np.add.reduceat(x[: at[-1]], at[:-1], axis=0) / many)


def _windows(rows: Rows, x: Array, left: Array, j: int, places: Array, least: float) -> Array:
    """Windows of joint j about a reversal of x (N,), at each of these places [s].

    Returns:
        (LATE, p) [A]; NaN where there is none.
    """
    y = np.full((len(LATE), PATTERN), np.nan)
    for k, place in enumerate(places.tolist()):
        one = _window(rows, x, left, j, place, least)
        if one is not None:
            y[k] = one
    return y


def _window(rows: Rows, x: Array, left: Array, j: int, t0: float, least: float) -> Array | None:
    """Window of joint j about a reversal of x (N,) at t0, (p,) [A]; None where it is none.

    Args:
        least: weaker effects of friction are ignored where the joint does not reverse [A].
    """
    at = _edges(rows.t, t0)
    if at is None:
        return None
    seen = np.stack([x, left, rows.v[:, j], rows.drive[:, COULOMB, j], rows.doubt[:, j]], axis=1)
    x, left, v, friction, bristles = _means(seen, at).T
    before, after = x[BEFORE - FIRM - 1], x[BEFORE + FIRM]
    if not before * after < 0.0 or not (np.isfinite(left).all() and slides(v)):
        return None
    if v[0] * v[-1] < 0.0:
        return _apart(left, friction, bristles, *faded(friction, v))
    return _apart(left, *faded(friction, v), least=least)


def slides(v: Array) -> bool:
    """Whether a joint slides throughout, at v (BINS,) [rad/s], except in a brisk reversal.

    One that stands, creeps or sets off is held by an unknown friction.
    """
    side = np.where(np.abs(v) > STANDING, np.sign(v), 0.0)
    once = side[0] != 0.0 and (np.diff(side * side[-1]) >= 0.0).all()
    return bool(once and side[-1] != 0.0 and np.count_nonzero(side == 0.0) <= BRISK)


def faded(held: Array, v: Array) -> list[Array]:
    """Further possible effects of friction around a reversal, (BINS,) each.

    Args:
        held: Coulomb friction, in its own unit.
        v: [rad/s].
    """
    return [held * np.exp(-np.abs(v) / speed) for speed in FADES]


def _apart(left: Array, *friction: Array, least: float = 0.0) -> Array:
    """A window without its level, its slope and possible effects of friction, (p,).

    Args:
        least: weaker effects of friction are ignored [A].
    """
    known = np.column_stack([left, *friction])
    left, *friction = (known - LEVELS @ (LEVELS.T @ known)).T
    if friction:
        U, d, _ = np.linalg.svd(np.column_stack(friction), full_matrices=False)
        U = U[:, d > max(least, NOTHING * d[0])]
        left = left - U @ (U.T @ left)
    return np.asarray(left[KEPT])
