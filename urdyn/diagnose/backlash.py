"""A gap in a gear: the load is gone for a moment whenever it turns over.

Where the load turns over at t0 the motor leaves one flank and needs

    T = sqrt(4 b I_r / f)

to cross the whole gap 2 b under the friction it no longer overcomes; meanwhile the current lacks
what the load takes. Every reversal weighs each gap by that template, beside a level and a slope of
its own; Shiryaev-Roberts' sum over reversals alarms. While gravity keeps the gear on one flank
nothing of this is to be seen, whatever the gap: that is said, with a motion that would show it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from scipy.special import logsumexp

from urdyn.diagnose.event import Event
from urdyn.diagnose.rows import Rows, joined
from urdyn.diagnose.space import Space
from urdyn.tracking.passage import STANDING
from urdyn.types import Array, Mask

GAPS = np.array([5e-5, 1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3])  # [rad] half, that are looked for
BEFORE, LONGEST = 0.04, 0.06  # [s] before and after a reversal, or longer in this proportion
WIDER = 1.5  # [-] times the time that a gap takes, after which what it lacked must be back
WILD = 4.0  # [sd] that one row counts at most
CLEAR = 4.0  # [sd] of a load about its line, that it has to swing through
BENT, SPAN = 2.0, 0.02  # [-] times its usual bend over this time [s], beyond which a load jumps
SHARES = (1.0, 0.5)  # [-] of the template: the load is not quite gone, or not all of it known
POSES = 181  # that a probe is looked for among


@dataclass(frozen=True, eq=False)
class Reversals:
    """What reversals have told."""

    tail: Rows | None  # the rows that a reversal may still need
    R: Array  # (J, gaps) log of Shiryaev-Roberts' sums; -inf: nothing yet
    llr: Array  # (J, gaps) log likelihood since the sum began to grow
    shown: Array  # (J, gaps) [nats] that each gap would have shown, had it been there
    count: Array  # (J,) reversals that were judged
    since: Array  # (J,) [s] when the evidence began; NaN: none
    number: Array  # (J,) reversals since then
    told: Mask  # (J,)
    slid: Array  # (J,) [s] in motion
    lo: Array  # (J,) [rad] least angle met
    hi: Array  # (J,) [rad] largest


@dataclass(frozen=True, eq=False)
class Backlash:
    """Settings."""

    space: Space
    period: float  # [s] between rows
    rule: Mapping[str, float]  # promise, enough, warning, critical

    @cached_property
    def crossing(self) -> Array:
        """Time over each gap, (gaps, J) [s]."""
        drive = self.space.reference.drive
        return np.sqrt(4.0 * GAPS[:, None] * drive.rotor_inertia / drive.coulomb)

    @cached_property
    def longest(self) -> Array:
        """After a reversal, time in which each gap is crossed and something is left, (gaps, J)."""
        return np.asarray(np.maximum(LONGEST, WIDER * self.crossing))

    def init(self) -> Reversals:
        """Nothing seen yet."""
        J = self.space.joints
        nothing, never = np.zeros(J), np.full((J, len(GAPS)), -np.inf)
        nan = np.full(J, np.nan)
        return Reversals(
            None, never, np.zeros_like(never), np.zeros_like(never), nothing, nan, nothing,
            np.zeros(J, dtype=bool), nothing, np.full(J, np.inf), np.full(J, -np.inf),
        )  # fmt: skip

    def step(
        self, state: Reversals, rows: Rows, tool: Array, ill: Mask
    ) -> tuple[Reversals, list[Event], Mask]:
        """A beat on; also rows in which a gap that is known may be open, (N, J).

        Args:
            tool: inertials that are carried, (10,).
            ill: joints whose sensor is not to be believed, (J,).
        """
        longest = self.longest.max()
        earlier = longest * BEFORE / LONGEST
        whole, done = rows, rows.t[0] + earlier
        if state.tail is not None and rows.t[0] - state.tail.t[-1] < 5.0 * self.period:
            whole, done = joined((state.tail, rows)), state.tail.t[-1] - longest
        state = self._moved(state, rows)
        K = self.space.reference.drive.gain
        own = np.einsum("njk,k->nj", whole.tool, tool)
        load = whole.load + K * own
        left = whole.residual - own
        ready = whole.t <= whole.t[-1] - longest
        new = whole.t > done
        turned = np.zeros(load.shape, dtype=bool)
        turned[1:] = load[1:] * load[:-1] < 0.0
        found: list[Event] = []
        for row, j in np.argwhere(turned & (ready & new)[:, None] & ~ill):
            state = self._reversal(state, whole, load[:, j], left[:, j], int(row), int(j))
            event = self._event(state, int(j), float(whole.t[-1]))
            if event:
                told = state.told.copy()
                told[j] = True
                state, found = replace(state, told=told), [*found, event]
        keep = int(np.searchsorted(whole.t, whole.t[-1] - earlier - longest - self.period))
        open_now = state.told & _lately(turned, whole.t, self.longest[-1])[len(whole) - len(rows) :]
        return replace(state, tail=whole.part(keep, len(whole))), found, open_now

    def _moved(self, state: Reversals, rows: Rows) -> Reversals:
        moving = (np.abs(rows.v) > STANDING).sum(axis=0) * self.period
        q = np.where(np.isfinite(rows.q), rows.q, 0.0)
        return replace(
            state,
            slid=state.slid + moving,
            lo=np.minimum(state.lo, q.min(axis=0)),
            hi=np.maximum(state.hi, q.max(axis=0)),
        )

    def _reversal(
        self, state: Reversals, rows: Rows, load: Array, left: Array, row: int, j: int
    ) -> Reversals:
        """Weigh every gap by one reversal."""
        # the moment within the step in which the load was zero
        share = load[row - 1] / (load[row - 1] - load[row])
        t0 = rows.t[row - 1] + share * (rows.t[row] - rows.t[row - 1])
        llr, shown = np.zeros((2, len(GAPS)))
        for longest in np.unique(self.longest[:, j]):  # the shortest first
            of = self.longest[:, j] == longest
            told = self._weigh(rows, rows.t - t0, load, left, j, float(longest), of)
            if told is None:
                break
            llr[of], shown[of] = told
        return self._weighed(state, j, llr, shown, float(t0)) if shown.any() else state

    def _weigh(
        self, rows: Rows, after: Array, load: Array, left: Array, j: int, longest: float, gaps: Mask
    ) -> tuple[Array, Array] | None:
        """Log likelihood ratios of gaps that take as long, and what they would be [nats]."""
        at = (after > -longest * BEFORE / LONGEST) & (after < longest)
        if at.sum() < 8 or not np.isfinite(left[at]).all():
            return None
        if np.abs(rows.v[at, j]).min() < STANDING:  # a joint that stands is held by friction
            return None
        line = Polynomial.fit(after[at], load[at], 1)(after[at])
        if not self._whole(load[at], after[at], line) or self._jumps(load, at):
            return None
        K, noise = self.space.reference.drive.gain[j], self.space.noise[j]
        x = -(line / K) * ((after[at] > 0.0) & (after[at] < self.crossing[gaps, j, None]))
        scale = 1.0 / np.hypot(noise, rows.doubt[at, j])
        nuisance = scale[:, None] * np.stack([np.ones(at.sum()), after[at]], axis=1)
        q = np.linalg.qr(nuisance)[0]
        r, x = scale * left[at], scale * x
        r, x = r - q @ (q.T @ r), x - (x @ q) @ q.T
        r = np.clip(r, -WILD, WILD)
        louder = max(1.0, float(r @ r) / (len(r) - 2.0))  # what the model leaves just here
        power = np.sum(x**2, axis=1)
        of_each = [(c * (x @ r) - 0.5 * c**2 * power) / louder for c in SHARES]
        return logsumexp(of_each, axis=0) - np.log(len(SHARES)), 0.5 * power / louder

    def _whole(self, load: Array, after: Array, line: Array) -> bool:
        """The load turns over once, and for good: noise about zero is no reversal.

        What is wrong with accelerations is in the load, and reversed in the residual: a load that
        only they turn over would look like a gap.
        """
        if np.ptp(line) < CLEAR * np.std(load - line):
            return False
        side, before = np.sign(load), after < 0.0
        return bool(before.any() and (side[before] == side[0]).all()
                    and (side[~before] == -side[0]).all())  # fmt: skip

    def _jumps(self, load: Array, at: Mask) -> bool:
        """Whether a load turns over more sharply than accelerations can be told.

        They are those of some hundredths of a second. Where the true one jumps, the load that is
        made of them does so too early, and then too late: like a gap.
        """
        lag = max(1, round(SPAN / self.period))
        bend = np.abs(load[2 * lag :] - 2.0 * load[lag:-lag] + load[: -2 * lag])
        return bool(bend[at[lag:-lag]].mean() > BENT * np.median(bend))

    def _weighed(self, state: Reversals, j: int, llr: Array, shown: Array, t: float) -> Reversals:
        """One more reversal is judged.

        Args:
            llr: what it says for each gap, (gaps,) [nats].
            shown: what that would be on the average, were there such a gap, (gaps,) [nats].
            t: when it was [s].
        """
        R, total, told = state.R.copy(), state.llr.copy(), state.shown.copy()
        told[j] += shown
        count, number, since = state.count.copy(), state.number.copy(), state.since.copy()
        R[j] = np.logaddexp(R[j], 0.0) + llr
        fresh = total[j].max() + llr.max() <= 0.0
        total[j] = 0.0 if fresh else total[j] + llr
        number[j] = 0.0 if fresh else number[j] + 1.0
        since[j] = np.nan if fresh else (t if np.isnan(since[j]) else since[j])
        count[j] += 1.0
        return replace(state, R=R, llr=total, shown=told, count=count, number=number, since=since)

    def _event(self, state: Reversals, j: int, now: float) -> Event | None:
        evidence = float(logsumexp(state.R[j])) - np.log(self.space.joints * len(GAPS))
        if state.told[j] or evidence < self._needed:
            return None
        if state.number[j] < self.rule["enough"]:
            return None
        share = np.exp(state.R[j] - logsumexp(state.R[j]))
        gap = float(np.exp(share @ np.log(GAPS)))
        since = float(state.since[j]) if np.isfinite(state.since[j]) else now
        told: dict[str, Any] = {
            "half_gap_rad": gap,
            "reversals": int(state.number[j]),
            "statistic": evidence,
            "threshold": self._needed,
        }
        return Event("joint_backlash", j, since, now, 0.99, gap, told)

    @property
    def _needed(self) -> float:
        """Evidence at which a gap is told [nats]."""
        return float(np.log(self.rule["promise"]))

    def observable(self, state: Reversals) -> list[dict[str, Any]]:
        """Joint by joint, from which gap on this motion could show it, and what would."""
        arm, told = self.space.reference.arm, []
        needed = self._needed + np.log(self.space.joints * len(GAPS))
        for j, name in enumerate(arm.joint_names):
            count = int(state.count[j])
            plain = GAPS[state.shown[j] >= needed] if count >= self.rule["enough"] else GAPS[:0]
            seen = bool(len(plain) and plain[0] <= self.rule["critical"])
            row: dict[str, Any] = {"joint": j, "name": name, "reversals": count, "observable": seen}
            row |= {"half_gap_rad": float(plain[0]) if len(plain) else None}
            told.append(row if seen else row | self._probe(state, j))
        return told

    def _probe(self, state: Reversals, j: int) -> dict[str, Any]:
        """A motion in which this joint's load turns over."""
        arm, J = self.space.reference.arm, self.space.joints
        met = np.isfinite(state.lo)
        middle = 0.5 * (np.where(met, state.lo, 0.0) + np.where(met, state.hi, 0.0))
        q = np.tile(middle, (POSES, 1))
        q[:, j] = np.linspace(max(arm.lower[j], -np.pi), min(arm.upper[j], np.pi), POSES)
        still = np.zeros((POSES, J))
        load = self.space.arm.torque(q, still, still)[:, j]
        turns = np.flatnonzero(load[1:] * load[:-1] < 0.0)
        why = "not observable in this motion"
        if state.count[j] >= self.rule["enough"]:
            why += ": the load turns over too slowly"
        elif state.slid[j] > 1.0:
            why += ": the load keeps the gear on one flank"
        if np.ptp(load) < 0.05 * self.space.reference.drive.coulomb[j] or not len(turns):
            how = f"turn {arm.joint_names[j]} back and forth by 0.3 rad, as fast as allowed"
            return {"why": why, "probe": how}
        best = turns[np.argmin(np.abs(q[turns, j] - middle[j]))]
        pose = float(q[best, j])
        how = f"turn {arm.joint_names[j]} to and fro by 0.2 rad about {pose:.2f} rad"
        return {"why": why, "probe": how + ", where gravity turns over, as fast as allowed"}


def _lately(turned: Mask, t: Array, lasting: Array) -> Mask:
    """Rows in which the load has turned over no longer ago than this (J,) [s], (N, J)."""
    at = np.where(turned, t[:, None], -np.inf)
    return np.asarray(t[:, None] - np.maximum.accumulate(at, axis=0) < lasting)
