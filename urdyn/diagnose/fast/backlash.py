"""Backlash, a gap in a gear: the load vanishes for a moment whenever it reverses.

Either the motor crosses the gap (`crossing`), or the link flies through it (`flight`), depending on
the loop and the load; each reversal weighs each gap either way. Shiryaev-Roberts sums over
reversals, one for each gap and way, alarm by their mean: that is the price of testing so many.
While gravity keeps the gear on one flank nothing of this can be seen (see `observability`).

A gap that opens jolts other joints, so their reversals at that instant count less for gaps of
theirs. A swing reverses loads, or lacks current where they reverse: reversals wait until a swing
that they are part of would have been detected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.fast.crossing import BEFORE, GAPS, LONGEST, Crossing
from urdyn.diagnose.fast.flight import FLIGHTS, LONG, REACH, Flight
from urdyn.diagnose.fast.oscillation import HEARD
from urdyn.diagnose.fast.recurring import SURELY, Recurred, Recurring
from urdyn.diagnose.fast.recurring import at_first as none_recurred
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.fast_rules import BacklashRule
from urdyn.diagnose.residual.rows import Rows, joined
from urdyn.diagnose.residual.space import Space
from urdyn.signal.stretches import GAP
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Array, Mask

HALF = np.concatenate([GAPS, FLIGHTS])  # [rad] half gaps tested for
LAST = 128  # reversals kept: of a gap found by more it is not known when it opened


@dataclass(frozen=True, eq=False)
class Reversals:
    """Evidence from reversals."""

    tail: Rows | None  # the rows that a reversal may still need
    R: Array  # (J, gaps) of both ways, log of Shiryaev-Roberts sums; -inf: nothing yet
    llr: Array  # (J, gaps) log likelihood since it began to grow
    shown: Array  # (J, gaps) [nats] expected from each gap, had it been there
    count: Array  # (J,) reversals judged
    since: Array  # (J, gaps) [s] when it began to grow; NaN: it does not
    t: Array  # (J, LAST) [s] the latest reversals, the last last; NaN: none
    each: Array  # (J, gaps, LAST) [nats] their evidence; -inf: none
    number: Array  # (J, gaps) reversals since then
    told: Mask  # (J,)
    slid: Array  # (J,) [s] in motion
    recurred: Recurred


@dataclass(frozen=True, eq=False)
class Loaded:
    """Rows, compared with the model that carries a tool."""

    rows: Rows
    tool: Array  # (10,) its inertials
    load: Array  # (N, J) [N·m] modelled load of the joints
    left: Array  # (N, J) [A] residuals of their currents


@dataclass(frozen=True, eq=False)
class Backlash:
    """Sequential test for gaps in gears, over reversals of their load [Roberts1966]_."""

    space: Space
    period: float  # [s] between rows
    rule: BacklashRule

    @cached_property
    def crossing(self) -> Crossing:
        """Likelihood of gaps that motors cross."""
        return Crossing(self.space, self.period)

    @cached_property
    def flight(self) -> Flight:
        """Likelihood of gaps through which links fly."""
        return Flight(self.space, self.period)

    @cached_property
    def recurring(self) -> Recurring:
        """Test for whatever recurs at reversals."""
        return Recurring(self.space, self.rule)

    def init(self) -> Reversals:
        """Nothing seen yet."""
        J = self.space.joints
        nothing, never = np.zeros(J), np.full((J, len(HALF)), -np.inf)
        none, nan = np.zeros_like(never), np.full_like(never, np.nan)
        return Reversals(
            tail=None,
            R=never,
            llr=none,
            shown=none,
            count=nothing,
            since=nan,
            t=np.full((J, LAST), np.nan),
            each=np.full((*never.shape, LAST), -np.inf),
            number=none,
            told=np.zeros(J, dtype=bool),
            slid=nothing,
            recurred=none_recurred(J),
        )

    def step(
        self, state: Reversals, rows: Rows, tool: Array, ill: Mask, swung: Array, loud: Array
    ) -> tuple[Reversals, list[Event], Mask]:
        """One beat; also the rows in which a known gap may be open, (N, J).

        Args:
            tool: inertials carried, (10,).
            ill: joints whose sensor is not trusted, or whose loop rings, (J,).
            swung: [s] start and end of joints' swings, certain or possible, (2, J).
            loud: [s] start and end of what may have been pushes, (n, 2).
        """
        crossed = self.crossing.longest
        longest = max(crossed.max(), REACH, HEARD)
        earlier = crossed.max() * BEFORE / LONGEST
        whole, done = rows, rows.t[0] + earlier
        if state.tail is not None and rows.t[0] - state.tail.t[-1] < GAP * self.period:
            whole, done = joined((state.tail, rows)), state.tail.t[-1] - longest
        state = _forgotten(self._moved(state, rows), swung)
        seen = self._loaded(whole, tool)
        ready = whole.t <= whole.t[-1] - longest
        new = whole.t > done
        turned = np.zeros(seen.load.shape, dtype=bool)
        turned[1:] = seen.load[1:] * seen.load[:-1] < 0.0
        heard = (ready & new)[:, None] & ~ill & ~_during(swung, whole.t[:, None])
        judged = turned & heard
        found = list[Event]()
        for row, j in np.argwhere(judged).tolist():
            beside = turned[np.abs(whole.t - whole.t[row]) < REACH].any(axis=0)
            state = self._reversal(state, seen, row, j, beside)
            state, event = self._judged(state, j, float(whole.t[-1]))
            found += [event] if event else []
        state, more = self._recurs(state, seen, heard, loud)
        kept = longest + max(earlier, LONG) + self.period
        keep = int(np.searchsorted(whole.t, whole.t[-1] - kept))
        open_now = state.told & _lately(turned, whole.t, crossed[-1])[len(whole) - len(rows) :]
        return replace(state, tail=whole.part(keep, len(whole))), found + more, open_now

    def _loaded(self, rows: Rows, tool: Array) -> Loaded:
        own = np.einsum("njk,k->nj", rows.tool, tool)
        load = rows.load + self.space.reference.drive.gain * own
        return Loaded(rows, tool, load, rows.residual - own)

    def _recurs(
        self, state: Reversals, seen: Loaded, heard: Mask, loud: Array
    ) -> tuple[Reversals, list[Event]]:
        """Test what recurs at reversals of joints without a reported gap."""
        recurred, found = self.recurring.step(
            state.recurred,
            seen.rows,
            load=seen.load,
            left=seen.left,
            judged=heard,
            loud=loud,
            told=state.told,
        )
        told = state.told.copy()
        told[[event.joint for event in found]] = True
        return replace(state, recurred=recurred, told=told), found

    def _moved(self, state: Reversals, rows: Rows) -> Reversals:
        """Add the time in which joints moved."""
        moving = (np.abs(rows.v) > STANDING).sum(axis=0) * self.period
        return replace(state, slid=state.slid + moving)

    def _reversal(
        self, state: Reversals, seen: Loaded, row: int, j: int, beside: Mask
    ) -> Reversals:
        """Weigh each gap of joint j by one reversal, crossed or flown through.

        Args:
            row: the first after the reversal.
            beside: joints whose load reverses at about the same time, (J,).
        """
        rows, load, left = seen.rows, seen.load[:, j], seen.left[:, j]
        t0 = rows.zero(load, row)
        after = rows.t - t0
        crossed = self.crossing.weigh(rows, after, load=load, left=left, j=j)
        flown = self.flight.weigh(rows, after, load=load, left=left, j=j, tool=seen.tool)
        llr, shown = np.concatenate([crossed, flown], axis=1)
        if not shown.any():
            return state
        own = self._own(state, j, llr, beside)
        return _weighed(state, j, llr=own, shown=shown, t=t0)

    def _own(self, state: Reversals, j: int, llr: Array, beside: Mask) -> Array:
        """A reversal's evidence for gaps of joint j, (gaps,) [nats]; others may have jolted it.

        One of them has a gap with probability p, and its jolt then explains it equally well:

            llr' = llr - log(1 - p + p exp(llr))
        """
        others = beside & (np.arange(len(beside)) != j)
        each = np.append(self._evidence(state), self.rule.needed)  # the last: no gap anywhere
        is_other = np.append(others, False)
        jolted, own = (np.logaddexp.reduce(each[of]) for of in (is_other, ~is_other))
        return np.asarray(llr + np.logaddexp(own, jolted) - np.logaddexp(own, jolted + llr))

    def _evidence(self, state: Reversals) -> Array:
        """Evidence that each joint has a gap, (J,) [nats]."""
        sums = np.logaddexp.reduce(state.R, axis=1)
        return np.asarray(sums - np.log(self.space.joints * len(HALF)))

    def _judged(self, state: Reversals, j: int, now: float) -> tuple[Reversals, Event | None]:
        """Report a gap of joint j whose evidence now suffices."""
        evidence = float(self._evidence(state)[j])
        if state.told[j] or evidence < self.rule.needed:
            return state, None
        best = int(np.argmax(state.R[j]))
        if state.number[j, best] < self.rule.enough:
            return state, None
        told = state.told.copy()
        told[j] = True
        return replace(state, told=told), self._event(state, j, best, evidence, now)

    def _event(self, state: Reversals, j: int, best: int, evidence: float, now: float) -> Event:
        """The gap of joint j; `best` is the likeliest."""
        share = np.exp(state.R[j] - np.logaddexp.reduce(state.R[j]))
        gap = float(np.exp(share @ np.log(HALF)))
        said = {
            "half_gap_rad": gap,
            "reversals": int(state.number[j, best]),
            "statistic": evidence,
            "threshold": self.rule.needed,
        }
        return Event(
            kind="joint_backlash",
            joint=j,
            onset=float(state.since[j, best]),
            alarm=now,
            size=gap,
            evidence=said,
            unseen=_unseen(state, j),
        )


def _weighed(state: Reversals, j: int, llr: Array, shown: Array, t: float) -> Reversals:
    """State after one more reversal.

    Args:
        llr: its evidence for each gap, (gaps,) [nats].
        shown: its mean if there were such a gap, (gaps,) [nats].
        t: its time [s].
    """
    R, total, told = state.R.copy(), state.llr.copy(), state.shown.copy()
    told[j] += shown
    count, number, since = state.count.copy(), state.number.copy(), state.since.copy()
    at, each = state.t.copy(), state.each.copy()
    R[j] = np.logaddexp(R[j], 0.0) + llr
    fresh = total[j] + llr <= 0.0
    total[j] = np.where(fresh, 0.0, total[j] + llr)
    number[j] = np.where(fresh, 0.0, number[j] + (shown > 0.0))
    since[j] = np.where(fresh, np.nan, np.where(np.isnan(since[j]), t, since[j]))
    at[j], each[j] = np.append(at[j, 1:], t), np.append(each[j, :, 1:], llr[:, None], axis=1)
    count[j] += 1.0
    return replace(
        state,
        R=R,
        llr=total,
        shown=told,
        count=count,
        number=number,
        since=since,
        t=at,
        each=each,
    )


def _unseen(state: Reversals, j: int) -> float:
    """The reversal after which a gap of joint j opened as good as surely [s].

    Most reversals say little against a wide gap: as likely as the first one that shows it is any
    before it with the same sum of evidence since then.
    """
    since = np.logaddexp.reduce(np.cumsum(state.each[j, :, ::-1], axis=1), axis=0)  # latest first
    share = np.cumsum(np.exp(since - np.logaddexp.reduce(since)))
    first = min(int(np.searchsorted(share, SURELY)), LAST - 1)
    begun = state.recurred.begun
    return float(np.fmax(np.append(begun, state.t[j])[-2 - first], begun))


def _during(swung: Array, t: Array) -> Mask:
    """Whether t is within the swings, (2, J) [s]."""
    return np.asarray((swung[0] <= t) & (t <= swung[1]))


def _forgotten(state: Reversals, swung: Array) -> Reversals:
    """Without evidence that began to grow during a detected swing."""
    of, t = _during(swung[:, :, None], state.since), state.recurred.t
    t = np.where(_during(swung[:, :, None, None], t), np.nan, t)
    return replace(
        state,
        recurred=replace(state.recurred, t=t),
        each=np.where(_during(swung[:, :, None], state.t)[:, None], 0.0, state.each),
        R=np.where(of, -np.inf, state.R),
        llr=np.where(of, 0.0, state.llr),
        number=np.where(of, 0.0, state.number),
        since=np.where(of, np.nan, state.since),
    )


def _lately(turned: Mask, t: Array, lasting: Array) -> Mask:
    """Rows in which the load reversed at most `lasting` (J,) [s] ago, (N, J)."""
    at = np.where(turned, t[:, None], -np.inf)
    return np.asarray(t[:, None] - np.maximum.accumulate(at, axis=0) < lasting)
