"""The causal twin of `condition`: the same estimate, a sample at a time, for live use."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_count, given_number, positive
from urdyn.signal.channels import POSSIBLE
from urdyn.signal.gate import FINEST, Gate
from urdyn.signal.polynomial import (
    ORDERS,
    LocalPolynomial,
    half_window,
    instrument_half,
    joint_by_joint,
    weights,
)
from urdyn.signal.sample import Instant, Sample
from urdyn.signal.shifts import NEVER, Leap, jumps, without_turns
from urdyn.signal.stretches import EVEN, GAP, is_even
from urdyn.signal.stuck import Held, after, nothing_held, stuck
from urdyn.types import Array, Mask


@dataclass(frozen=True, eq=False)
class CausalState:
    """The last samples of this stretch, and counts of what was left out."""

    t: Array  # (n,) [s]
    rows: Array  # (n, 4, J) q, v, current, temperature; NaN where the gate refused them
    angles: Array  # (n, J) [rad] q as they came, for the gate first refuses a zero that jumps
    departures: Array  # (m, 2, J) of the last q and v from their prediction [rad, rad/s]
    held: Held
    frozen: Array  # (J,) velocities left out, of sensors that were stuck
    frozen_since: Array  # (J,) [s] the first time that one was; NaN: never
    restarts: int = 0  # gaps and clocks set back: the window began anew
    repeats: int = 0  # samples with the stamp of the one before, left out
    refused: int = 0  # other values that were marked as not measured
    jumped: Leap = NEVER  # the last jump of a zero
    clean: int = 0  # newest samples that lack nothing, each a period after the one before


@dataclass(frozen=True)
class Causal:
    """Kinematics at the stamp `lag` samples before the newest, as soon as a window is full.

    With lag = half (the default) it is the batch estimate, that much later; with lag 0 it has no
    delay and the noise of a one-sided fit. After a gap it restarts.
    """

    period: float  # [s] between samples, as a rule
    half: int | None = None  # [samples] half the window; None: by the rate
    degree: int = 4
    lag: int | None = None  # [samples] 0 .. 2 half; None: half
    offset: float | tuple[float, ...] = 0.0  # [s] by which the current leads; one, or one per joint
    gate: Gate | None = field(default_factory=Gate)  # None: every sample passes
    velocities: bool = True  # are measured; where they are not, a window takes more angles

    def __post_init__(self) -> None:
        takes = "a time above 0 [s]"
        object.__setattr__(self, "period", given_number(self.period, "period", takes, positive))
        if self.lag is not None:
            lag = given_count(self.lag, "lag", 0, 2 * self.fit.half)
            object.__setattr__(self, "lag", lag)

    @cached_property
    def fit(self) -> LocalPolynomial:
        """The local polynomial that is fitted to a full window."""
        by_rate = half_window(self.period, self.degree, self.velocities)
        half = by_rate if self.half is None else self.half
        return LocalPolynomial(half, self.degree, self.period)

    @cached_property
    def alone(self) -> LocalPolynomial:
        """The same through angles alone, of all samples that are remembered."""
        return replace(self.fit, half=instrument_half(self.fit.half, self.degree, self.period))

    def init(self, joints: int = 6) -> CausalState:
        """Nothing seen yet."""
        rows, angles, departures = (np.empty((0, *of, joints)) for of in ((4,), (), (2,)))
        nothing = nothing_held(-np.inf, np.full((2, joints), np.nan))
        never = np.zeros(joints), np.full(joints, np.nan)
        return CausalState(np.empty(0), rows, angles, departures, nothing, *never)

    def step(self, state: CausalState, sample: Sample) -> tuple[CausalState, Instant | None]:
        """One sample on; an instant once the window is full. InputError for one of other joints."""
        dt = sample.t - state.t[-1] if len(state.t) else np.inf
        if dt == 0:
            return replace(state, repeats=state.repeats + 1), None
        row = _row(sample, state.angles.shape[1:])
        wild = np.abs(row) > POSSIBLE[:, None]
        if not np.count_nonzero(row[:3]):  # all 0, as no robot is: the stream has lost it
            wild[:3] = True
        if np.count_nonzero(wild):
            row[wild] = np.nan
            state = replace(state, refused=state.refused + int(np.count_nonzero(wild[:2])))
        if 0 < dt <= GAP * self.period:
            state = self._admit(state, sample.t, row, dt)
        else:
            state = _restart(state, sample.t, row)
        return self._estimate(state) if len(state.t) >= self.fit.samples else (state, None)

    def missed(self, state: CausalState) -> tuple[float, Mask, Array]:
        """Stamp [s] of the row `lag` back, which angles it lacks, and its currents [A]."""
        at = max(len(state.t) - 1 - self._lag, 0)
        angle, _, current, _ = state.rows[at]
        return float(state.t[at]), np.isnan(angle), current

    @property
    def _lag(self) -> int:
        return self.fit.half if self.lag is None else self.lag

    def _admit(self, state: CausalState, t: float, row: Array, dt: float) -> CausalState:
        """The window one sample on, with what the gate refuses marked as not measured."""
        keep = slice(1 - self.alone.samples, None)
        angles = np.concatenate([state.angles[keep], row[:1]])
        departure, refused = state.departures[-1], 0
        held = after(state.held, t, dt, row[:2].copy())
        if self.gate:
            before = state.rows[-1, :2]
            departure = self.gate.departure(before, row[:2], dt)
            speeds = before[1], row[1]
            wrong = self.gate.refuses(departure, state.departures, dt, speeds)
            if refused := int(np.count_nonzero(wrong)):
                row[:2][wrong] = np.nan
        lacks = np.count_nonzero(np.isnan(row[:2])) > 0
        clean = 0 if lacks or abs(dt - self.period) > EVEN * self.period else state.clean + 1
        stamps = np.concatenate([state.t[keep], [t]])
        rows = np.concatenate([state.rows[keep], row[None]])
        frozen, since = state.frozen, state.frozen_since
        if np.count_nonzero(ill := stuck(held)):
            clean = 0
            none = ill & (stamps[:, None, None] > held.since)
            angle, velocity = (none & np.isfinite(rows[:, :2])).sum(axis=0)
            refused += int(angle.sum())
            frozen = frozen + velocity
            since = np.where(ill[1], np.fmin(since, held.since[1]), since)
            rows[:, :2][none] = np.nan
            angles[none[:, 0]] = np.nan
        departures = state.departures[1 - self.fit.samples :]
        return CausalState(
            t=stamps,
            rows=rows,
            angles=angles,
            departures=np.concatenate([departures, departure[None]]),
            held=held,
            frozen=frozen,
            frozen_since=since,
            restarts=state.restarts,
            repeats=state.repeats,
            refused=state.refused + refused,
            jumped=state.jumped,
            clean=clean,
        )

    def _estimate(self, state: CausalState) -> tuple[CausalState, Instant]:
        """The motion at the stamp `lag` samples back, + offset."""
        fit, lag = self.fit, self._lag
        row = fit.samples - 1 - lag
        shift = np.zeros(state.rows.shape[2])
        t, rows = state.t[-fit.samples :], state.rows[-fit.samples :]
        measured = rows[:, :2]
        steady = known = even = whole = state.clean >= len(state.t)  # it nearly always is
        if not steady:
            alike, told = is_even(state.t, self.period), np.isfinite(state.rows[:, :2])
            steady, known = bool(alike.all()), bool(told[:, 0].all())
            even, whole = bool(alike[1 - fit.samples :].all()), bool(told[-fit.samples :].all())
        if even and whole:
            operator = _operator(fit, (fit.half - lag) * self.period, self.offset)
            of_each = measured.transpose(2, 1, 0).reshape(-1, operator.shape[2], 1)
            orders = np.ascontiguousarray((operator @ of_each)[..., 0].T)
        else:
            q, v = measured[:, 0], measured[:, 1]
            if not whole:  # the gate refuses the sample at which a zero jumps
                state, v, each = self._jumped(state, row)
                since, shift = np.cumsum(each, axis=0), without_turns(each[row])
                if np.count_nonzero(np.abs(shift) > FINEST):
                    state = replace(state, jumped=Leap(float(t[row]), each[row].copy()))
                q = np.where(each == 0.0, q, state.angles[-fit.samples :]) - (since - since[row])
            at = np.broadcast_to(np.asarray(self.offset, dtype=np.float64), q.shape[1:])[None]
            window = (t - t[row])[None], q[None], v[None], at
            orders = fit.estimate(*(window if whole else joint_by_joint(*window)))
            orders = orders.reshape(ORDERS, -1)
        (q, v, a, jerk), (current, temperature) = orders, rows[row, 2:]
        full = len(state.t) == self.alone.samples
        alone = self._alone(state, lag, steady) if known and full else (None, None)
        instant = Instant(float(t[row]), q, v, a, jerk, current, temperature, shift, *alone)
        return state, instant

    def _jumped(self, state: CausalState, row: int) -> tuple[CausalState, Array, Array]:
        """Velocities in the window, (m, J), NaN where a jump reached them, and shifts of zeros.

        The NaNs are remembered once a jump has come as far as `row`: until then it may be undone.
        """
        rows, window = state.rows, slice(-self.fit.samples, None)
        t, angles, v = state.t[window], state.angles[window], rows[window, 1]
        found = jumps(t, angles, v, self.fit.half, state.jumped)
        if np.count_nonzero(found.misled):
            rows = rows.copy()
            rows[window, 1][found.misled] = np.nan
        if np.count_nonzero(found.shift[: row + 1]):
            state = replace(state, rows=rows, clean=0)
        return state, rows[window, 1], found.shift

    def _alone(self, state: CausalState, lag: int, even: bool) -> Array:
        """Acceleration and jerk there by angles alone, (2, J) [rad/s², rad/s³]."""
        if not even:
            t, q = state.t - state.t[-1 - lag], state.rows[:, 0]
            at = np.broadcast_to(np.asarray(self.offset, dtype=np.float64), q.shape[1:])
            found = self.alone.estimate(t[None], q[None], np.full_like(q, np.nan)[None], at[None])
            return found[2:, 0]
        ahead = (self.alone.half - lag) * self.period
        operator = _operator(self.alone, ahead, self.offset, velocities=False)
        of_q = operator[:, 2:, : self.alone.samples].swapaxes(0, 1)
        return np.asarray(np.vecdot(of_q, state.rows[:, 0].T))


@lru_cache(maxsize=16)
def _operator(
    fit: LocalPolynomial, ahead: float, offset: float | tuple[float, ...], velocities: bool = True
) -> Array:
    """Weights of angles, then velocities, of a full uniform window, (1 or J, 4, 2 m).

    They give the motion at `ahead` + offset [s] from the window's centre.
    """
    leads = offset if isinstance(offset, tuple) else (offset,)
    each = (weights(fit, ahead + lead, velocities) for lead in leads)
    return np.array([np.concatenate(of_both, axis=1) for of_both in each])


def _row(sample: Sample, joints: tuple[int, ...]) -> Array:
    """Angles, velocities, currents and temperatures of a sample, (4, J)."""
    row = sample.q, sample.v, sample.current, sample.temperature
    shapes = [np.shape(x) for x in row]
    if any(shape != joints for shape in shapes):
        raise InputError(
            f"q, v, current and temperature of a sample are {', '.join(map(str, shapes))}: "
            f"each is to be {joints}, as the arm has joints"
        )
    return np.array(row)


def _restart(state: CausalState, t: float, row: Array) -> CausalState:
    """A window that begins with this sample."""
    return CausalState(
        t=np.array([t]),
        rows=row[None],
        angles=row[None, 0],
        departures=np.full_like(row[None, :2], np.nan),
        held=nothing_held(t, row[:2]),
        frozen=state.frozen,
        frozen_since=state.frozen_since,
        restarts=state.restarts + (len(state.t) > 0),
        repeats=state.repeats,
        refused=state.refused,
    )
