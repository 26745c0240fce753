"""Slow kinds: moments in, changes out.

A moment, half a second, is first told whose load it was; then it says, with a passing payload
marginalised, what it knows of joints, links and tool, and joins the block that the bank takes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from urdyn.diagnose import bank as onsets
from urdyn.diagnose import carried, loudness
from urdyn.diagnose.bank import Bank, Block, Straying
from urdyn.diagnose.carried import Mode
from urdyn.diagnose.explain import (
    Explanation,
    Suspects,
    explanation,
    gathered,
    instant_evidence,
    suspects,
)
from urdyn.diagnose.loudness import Loudness
from urdyn.diagnose.moment import Pool, pooled
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.rules import PAYLOAD_STATES, Rules, SlowKind
from urdyn.diagnose.space import Space
from urdyn.types import Array, Index

MOMENT = 0.5  # [s]
BLOCK = 5.0  # [s]
DELAY = 2  # moments that one waits
ENOUGH = 10  # values of current in a moment that says anything
KEPT = 48  # blocks that are remembered, to look at them again once a fault is known
CONFIDENT = 0.95  # [-] share of the evidence at which a finding is told at once
PATIENCE = 12  # blocks that an alarm waits for that
GROWTH = 600.0  # [s] in which a known fault may change by as much as it was expected to
LASTING = 0.2  # [-] of the time away that a load must have been carried to be there to stay
CERTAIN = 0.99  # [-] that what was carried for so long is another load
MARGIN = 3.0  # [nats] by which a payload has to explain a moment better than any fault of a joint


@dataclass(frozen=True)
class Push:
    """Whether something pushes the arm now, and when something last did."""

    going: bool = False
    begin: float = np.inf  # [s]
    end: float = -np.inf  # [s]

    def within(self, begin: float, end: float) -> bool:
        """Whether it was in this time."""
        return self.begin <= end and begin <= self.end


@dataclass(frozen=True, eq=False)
class Change:
    """A change that is there to stay."""

    suspect: int  # among all that is looked for
    onset: float  # [s] likeliest
    onset_lo: float  # [s] 5 %
    onset_hi: float  # [s] 95 %
    alarm: float  # [s]
    confidence: float  # [-]
    evidence: float  # [nats] beyond the healthy arm
    size: float  # of the change, in the unit of the state that measures it
    size_sd: float
    rate: float  # [1/s]; 0 of a step
    rate_sd: float
    detail: tuple[float, ...] = ()  # of a payload: mass, mx, my, mz
    rivals: tuple[tuple[int, float], ...] = ()  # other suspects and their shares


@dataclass(frozen=True, eq=False)
class Anchor:
    """The healthy arm before the first of the blocks that are remembered."""

    t: float  # [s]; NaN: no block was ever forgotten
    x: Array
    P: Array


@dataclass(frozen=True, eq=False)
class Carrying:
    """What is at the tool."""

    modes: tuple[Mode, ...]  # the first is what is carried as a rule
    now: int = 0
    away: tuple[float, ...] = ()  # [s] of motion in each mode since the first was last carried
    since: float = np.nan  # [s] when that began


@dataclass(frozen=True, eq=False)
class Waiting:
    """A moment that waits until it is known whose load it was, and that nobody pushed."""

    pool: Pool
    mode: Mode
    usual: bool  # carried is what is carried as a rule
    begin: float  # [s]
    end: float  # [s]


@dataclass(frozen=True, eq=False)
class SlowState:
    """All that is remembered from moment to moment."""

    bank: Bank
    A: Array  # (n, n) of the block that is being gathered
    b: Array  # (n,)
    begin: float  # [s] of that block; NaN: none
    waiting: tuple[Waiting, ...]
    pools: tuple[Pool, ...]  # of the block that is being gathered
    loudness: Loudness
    carrying: Carrying
    anchor: Anchor
    blocks: tuple[Block, ...] = ()
    waited: int = 0  # blocks since the alarm; 0: none
    known: tuple[int, ...] = ()  # suspects that are found
    found: tuple[Change, ...] = ()  # in this step


@dataclass(frozen=True, eq=False)
class Slow:
    """Settings; the state is passed along."""

    space: Space
    period: float  # [s] between rows
    rules: Rules

    @cached_property
    def payload(self) -> Index:
        """Places of what the tool carries."""
        at = self.space.places["payload"]
        return np.arange(at.start, at.stop)

    @cached_property
    def rest(self) -> Index:
        """Places of all others."""
        return np.setdiff1d(np.arange(self.space.size), self.payload)

    @cached_property
    def straying(self) -> Straying:
        """How far the healthy arm strays."""
        return self.rules.straying(self.space)

    @cached_property
    def of(self) -> Suspects:
        """Everything that is looked for."""
        return suspects(self.space, self.rules.slow)

    @cached_property
    def E(self) -> Array:
        """Directions of all that, (n, p)."""
        return self.of.directions(self.space.size)

    @cached_property
    def threshold(self) -> float:
        """Log of the blocks to a false alarm."""
        return float(np.log(self.rules.hours * 3600.0 / BLOCK))

    @cached_property
    def tool(self) -> SlowKind | None:
        """The kind that is a change of payload, if any."""
        return next((kind for kind in self.rules.slow if kind.of_tool), None)

    def init(self) -> SlowState:
        """Before the first moment."""
        n, p = self.space.size, len(self.of.states)
        P = self.space.cov + np.diag(self.rules.stray(self.space, "day") ** 2)
        P[self.payload] = P[:, self.payload] = 0.0
        P[self.payload, self.payload] = carried.NOTHING**2
        lasting = self.rules.noise.share * 2.0 * self.rules.noise.lasting / self.period
        loud = (self.space.slow / self.space.noise) ** 2 + lasting
        return SlowState(
            bank=onsets.first(np.zeros(n), P, p),
            A=np.zeros((n, n)),
            b=np.zeros(n),
            begin=np.nan,
            waiting=(),
            pools=(),
            loudness=loudness.first(loud),
            carrying=Carrying((carried.commissioned(),)),
            anchor=Anchor(np.nan, np.zeros(n), P),
        )

    def moment(self, state: SlowState, rows: Rows, push: Push) -> SlowState:
        """One moment on; `found` are the changes that it settles."""
        state = replace(state, found=())
        noise = self.space.noise * np.sqrt(state.loudness.power)
        pool, begin, end = pooled(rows, self.period, noise), float(rows.t[0]), float(rows.t[-1])
        if pool.count.sum() < ENOUGH:
            return state
        before, carrying = state.carrying, self._carried(state, pool, end)
        waiting = tuple(w for w in state.waiting if not push.within(w.begin, w.end))
        if carrying.now != before.now:  # it changed in this moment or in the one before
            waiting = waiting[:-1]
        elif not push.within(begin, end):
            mode = carrying.modes[carrying.now]
            waiting = (*waiting, Waiting(pool, mode, carrying.now == 0, begin, end))
        state = replace(state, carrying=carrying, waiting=waiting)
        while len(state.waiting) > DELAY and not push.going:
            ripe, *left = state.waiting
            state = self._gather(replace(state, waiting=tuple(left)), ripe)
        return self._settled(state, end)

    def _gather(self, state: SlowState, ripe: Waiting) -> SlowState:
        pool = self._unladen(ripe)
        began = ripe.begin if np.isnan(state.begin) else state.begin
        pools = (*state.pools, pool) if ripe.usual else state.pools
        state = replace(state, A=state.A + pool.A, b=state.b + pool.b, begin=began, pools=pools)
        return self._block(state, ripe.end) if ripe.end - began > BLOCK - MOMENT else state

    def _block(self, state: SlowState, end: float) -> SlowState:
        A, b = onsets.strayed(state.A, state.b, self.straying.window)
        block = Block(state.begin, end, A, b)
        straying = self._loosened(state.known)
        heard = loudness.heard(state.loudness, state.pools, self.space, self.space.noise)
        anchor, blocks = state.anchor, (*state.blocks, block)
        if len(blocks) > KEPT:
            anchor = Anchor(*onsets.followed(anchor.t, anchor.x, anchor.P, blocks[0], straying))
        state = replace(
            state,
            bank=onsets.step(state.bank, block, straying, self.E),
            A=np.zeros_like(A),
            b=np.zeros_like(b),
            begin=np.nan,
            pools=(),
            loudness=heard,
            anchor=anchor,
            blocks=blocks[-KEPT:],
        )
        return self._judged(state)

    def _loosened(self, known: tuple[int, ...]) -> Straying:
        """How far an arm strays some of whose faults are known: those go where they want to."""
        walk = self.straying.walk.copy()
        for k in known:
            suspect = self.of.each[k]
            walk[self.of.states[suspect.places]] += suspect.sd / np.sqrt(GROWTH)
        return replace(self.straying, walk=walk)

    def _judged(self, state: SlowState) -> SlowState:
        """After a block: is there an alarm, and is it clear of what?"""
        of = [k for k in range(len(self.of.each)) if k not in state.known]
        weight = gathered(state.bank, self.of)[of]
        whole = float(logsumexp(weight))
        if whole - np.log(len(of)) < self.threshold:
            return replace(state, waited=0)
        state = replace(state, waited=state.waited + 1)
        share = np.exp(weight - whole)
        top = int(np.argmax(share))
        told = explanation(state.bank, self.of.each[of[top]])
        large = abs(told.size) > self.of.each[of[top]].kind.least
        if not large or (share[top] < CONFIDENT and state.waited < PATIENCE):
            return state
        order = np.argsort(-share)[1:3]
        rivals = tuple((of[k], float(share[k])) for k in order)
        return self._accepted(state, of[top], told, float(share[top]), rivals)

    def _accepted(
        self,
        state: SlowState,
        k: int,
        told: Explanation,
        share: float,
        rivals: tuple[tuple[int, float], ...],
    ) -> SlowState:
        of_tool = told.suspect.kind.of_tool
        detail = (
            state.carrying.modes[0].mean[: len(PAYLOAD_STATES)] + state.bank.x[self.payload][:4]
        )
        change = Change(
            k, told.onset, told.onset_lo, told.onset_hi, told.t, share, told.evidence,
            told.size, told.size_sd, told.rate, told.rate_sd,
            tuple(detail.tolist()) if of_tool else (), rivals,
        )  # fmt: skip
        state = replace(state, found=(*state.found, change), waited=0)
        if of_tool:
            return self._settled_on(state, state.bank.x[self.payload])
        return self._again(replace(state, known=(*state.known, k)))

    def _settled_on(self, state: SlowState, more: Array) -> SlowState:
        """Take what is carried as what is carried as a rule; all else is known as it was."""
        first, *others = state.carrying.modes
        modes = (replace(first, mean=first.mean + more), *others)
        return self._afresh(replace(state, carrying=replace(state.carrying, modes=modes)))

    def _afresh(self, state: SlowState) -> SlowState:
        """Look for changes from here on, of an arm that carries what it carries now."""
        x, P = state.bank.x.copy(), state.bank.P.copy()
        x[self.payload] = 0.0
        P[self.payload] = P[:, self.payload] = 0.0
        P[self.payload, self.payload] = carried.NOTHING**2
        bank = onsets.first(x, P, len(self.of.states))
        t = state.bank.t
        return replace(state, bank=replace(bank, t=t), anchor=Anchor(t, x, P), blocks=())

    def _opened(self, state: SlowState) -> Array:
        """What was known before the blocks that are remembered, nothing of what is found."""
        P = state.anchor.P.copy()
        for k in state.known:
            at = self.of.states[self.of.each[k].places]
            P[at, at] += (3.0 * self.of.each[k].sd) ** 2
        return P

    def _again(self, state: SlowState) -> SlowState:
        """The blocks that are remembered once more, with what is known free to have changed."""
        bank = onsets.first(state.anchor.x, self._opened(state), len(self.of.states))
        bank = replace(bank, t=state.anchor.t)
        straying = self._loosened(state.known)
        for block in state.blocks:
            bank = onsets.step(bank, block, straying, self.E)
        return self._judged(replace(state, bank=bank))

    def _unladen(self, ripe: Waiting) -> Pool:
        """What a moment says of all states; of the payload nothing while another one is carried."""
        pool, mode, at = ripe.pool, carried.spread(ripe.mode), self.payload
        residual = pool.residual - pool.H[:, at] @ mode.mean
        if ripe.usual:
            return replace(pool, b=pool.b - pool.A[:, at] @ mode.mean, residual=residual)
        mode = carried.alike(mode)
        cross, App = pool.A[:, at], pool.A[np.ix_(at, at)]
        inner = np.linalg.solve(np.eye(len(at)) + mode.cov @ App, mode.cov)
        A = pool.A - cross @ inner @ cross.T
        b = pool.b - cross @ (mode.mean + inner @ (pool.b[at] - App @ mode.mean))
        A[at] = A[:, at] = b[at] = 0.0
        return replace(pool, A=0.5 * (A + A.T), b=b, residual=residual)

    def _carried(self, state: SlowState, pool: Pool, t: float) -> Carrying:
        """Whose load the moment was."""
        carrying, rest, at = state.carrying, self.rest, self.payload
        P = (state.bank.P + np.diag(self.straying.window**2))[np.ix_(rest, rest)]
        told = carried.shown(pool, at, rest, state.bank.x[rest], P)
        modes, now = list(carrying.modes), carrying.now
        fits = [carried.fit(told, carried.spread(mode)) for mode in modes]
        best, new = int(np.argmax(fits)), carried.anything(t)
        gain = carried.fit(told, new) - fits[best]
        if gain > carried.SURE and gain > self._of_joints(state, pool, modes[best]) + MARGIN:
            modes, now = carried.remembered(modes, carried.learnt(told, new, t))
        elif fits[best] > fits[now] + carried.SURE:
            now = best
        if now:
            modes[now] = carried.learnt(told, carried.spread(modes[now]), t)
        return self._away(carrying, tuple(modes), now, t)

    def _of_joints(self, state: SlowState, pool: Pool, mode: Mode) -> float:
        """How well the best fault of a joint explains a moment, beside the healthy arm [nats]."""
        P = state.bank.P + np.diag(self.straying.window**2)
        at = self.payload
        P[at] = P[:, at] = 0.0
        P[np.ix_(at, at)] = carried.spread(mode).cov
        x = state.bank.x.copy()
        x[at] = mode.mean
        keep = np.linalg.inv(np.eye(len(P)) + pool.A @ P)
        C = self.E.T @ keep @ pool.A @ self.E
        d = self.E.T @ keep @ (pool.b - pool.A @ x)
        return instant_evidence(C, d, self.of)

    def _away(self, before: Carrying, modes: tuple[Mode, ...], now: int, t: float) -> Carrying:
        """How long the arm has not carried what it carries as a rule."""
        if not now:
            return Carrying(modes, 0)
        away = np.zeros(len(modes))
        if len(before.away) == len(modes):
            away[:] = before.away
        away[now] += MOMENT
        since = t - MOMENT if np.isnan(before.since) else before.since
        return Carrying(modes, now, tuple(away.tolist()), since)

    def _settled(self, state: SlowState, t: float) -> SlowState:
        """Whether what is carried now is there to stay."""
        carrying, tool = state.carrying, self.tool
        if tool is None or not carrying.away:
            return state
        away = np.array(carrying.away)
        stays = int(np.argmin([m.mean[0] if s > LASTING * away.sum() else np.inf
                               for m, s in zip(carrying.modes, away, strict=True)]))  # fmt: skip
        mode, first = carrying.modes[stays], carrying.modes[0]
        more = mode.mean - first.mean
        hold = tool.hold_lighter if more[0] < 0.0 else tool.hold
        if away.sum() < hold or abs(more[0]) < tool.least:
            return state
        k = next(k for k, each in enumerate(self.of.each) if each.kind is tool)
        sd = float(np.sqrt(mode.cov[0, 0]))
        change = Change(
            k, carrying.since, carrying.since - 2.0 * MOMENT, carrying.since, t, CERTAIN, np.nan,
            float(more[0]), sd, 0.0, 0.0, tuple(mode.mean[:4].tolist()),
        )  # fmt: skip
        others = [m for j, m in enumerate(carrying.modes) if j not in (0, stays)]
        modes = (mode, first, *others)
        now = 0 if carrying.now == stays else 2 + others.index(carrying.modes[carrying.now])
        carrying = Carrying(modes, now)
        state = replace(state, carrying=carrying, found=(*state.found, change))
        return self._afresh(state)

    def levels(self, state: SlowState) -> list[tuple[int, float, float]]:
        """Suspects that are found, and how far their change has gone by now: size, sd."""
        told = []
        for k in state.known:
            at = int(self.of.states[self.of.each[k].places[0]])
            told.append((k, float(state.bank.x[at]), float(np.sqrt(state.bank.P[at, at]))))
        return told

    def trace(self, state: SlowState, k: int) -> list[tuple[float, float, float]]:
        """How a found change went in the blocks that are remembered: time, size, sd."""
        at = int(self.of.states[self.of.each[k].places[0]])
        t, x, P = state.anchor.t, state.anchor.x, self._opened(state)
        straying, told = self._loosened(state.known), []
        for block in state.blocks:
            t, x, P = onsets.followed(t, x, P, block, straying)
            told.append((t, float(x[at]), float(np.sqrt(P[at, at]))))
        return told
