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
from urdyn.diagnose import carried, warmth
from urdyn.diagnose.bank import Bank, Block, Straying
from urdyn.diagnose.carrying import MOMENT, Carrying, Waiting
from urdyn.diagnose.change import Change, Push
from urdyn.diagnose.explain import Explanation, Suspects, explanation, gathered, suspects
from urdyn.diagnose.healthy import Healthy
from urdyn.diagnose.learning import Learning, Learnt
from urdyn.diagnose.loads import DELAY, Belief, Loads
from urdyn.diagnose.moment import Pool, averaged, pooled
from urdyn.diagnose.recall import Recall, Series
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.rules import PAYLOAD_STATES, Rules
from urdyn.diagnose.space import Space
from urdyn.diagnose.stay import Stay
from urdyn.types import Array

BLOCK = 5.0  # [s]
ENOUGH = 10  # values of current in a moment that says anything
NEAR = 10.0  # [nats] below an alarm, from which on a suspect is another's rival
CONFIDENT = 0.95  # [-] share of the evidence at which a finding is told at once
UNSURE = 2.0  # [sd] below which another finding leaves nothing of a change
PATIENCE = 12  # blocks that an alarm waits for that


@dataclass(frozen=True, eq=False)
class SlowState:
    """All that is remembered from moment to moment."""

    bank: Bank
    A: Array  # (n, n) of the block that is being gathered
    b: Array  # (n,)
    warm: Array  # (3, J) sum over its moments
    moments: int  # in it
    begin: float  # [s] of that block; NaN: none
    end: float  # [s] of its last moment
    waiting: tuple[Waiting, ...]
    learnt: Learnt
    carrying: Carrying
    recall: Recall
    before: tuple[Bank, Recall]  # as they were when this program began
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
    def of(self) -> Suspects:
        """Everything that is looked for."""
        return suspects(self.space, self.rules.slow)

    @cached_property
    def healthy(self) -> Healthy:
        """The arm that nothing is wrong with."""
        return Healthy(self.space, self.rules, self.of)

    @cached_property
    def learning(self) -> Learning:
        """What is learnt of it."""
        return Learning(self.space, self.healthy)

    @cached_property
    def loads(self) -> Loads:
        """What the tool carries."""
        return Loads(self.space, self.of)

    @cached_property
    def stay(self) -> Stay | None:
        """Which of that is there to stay, if anybody asks."""
        kind = next((kind for kind in self.rules.slow if kind.of_tool), None)
        return Stay(self.space, self.of, kind) if kind else None

    @cached_property
    def E(self) -> Array:
        """Directions of everything that is looked for, (N, p)."""
        return self.of.directions(self.healthy.size)

    @cached_property
    def threshold(self) -> float:
        """Log of the blocks to a false alarm."""
        return float(np.log(self.rules.hours * 3600.0 / BLOCK))

    def init(self) -> SlowState:
        """Before the first moment."""
        n, J, (x, P) = self.space.size, self.space.joints, self.healthy.first
        return SlowState(
            bank=onsets.first(x, P, self.E.shape[1]),
            A=np.zeros((n, n)),
            b=np.zeros(n),
            warm=np.zeros((3, J)),
            moments=0,
            begin=np.nan,
            end=np.nan,
            waiting=(),
            learnt=self.learning.first(self.rules.noise, self.period),
            carrying=Carrying((carried.commissioned(),)),
            recall=Recall(np.nan, x, P),
            before=(onsets.first(x, P, self.E.shape[1]), Recall(np.nan, x, P)),
        )

    def moment(self, state: SlowState, rows: Rows, push: Push) -> SlowState:
        """One moment on; `found` are the changes that it settles."""
        state = replace(state, found=())
        noise = self.space.noise * np.sqrt(state.learnt.loudness.power)
        means, begin, end = averaged(rows, self.period, noise), float(rows.t[0]), float(rows.t[-1])
        if means.count.sum() < ENOUGH:
            return state
        pool = pooled(means)
        other = onsets.another(state.bank.t, begin)
        belief = self._belief(state, state.bank, pool, other)
        waiting, path = list(state.waiting), list(state.carrying.path)
        for k in reversed(range(len(waiting))):
            if push.within(waiting[k].begin, waiting[k].end):
                del waiting[k], path[k]
        state = replace(state, carrying=replace(state.carrying, path=tuple(path)))
        if not push.within(begin, end):
            waiting.append(self.loads.waiting(means, pool, belief, begin, end))
            state = replace(state, carrying=self.loads.carried(state.carrying, belief, waiting))
        state = replace(state, waiting=tuple(waiting))
        while len(state.waiting) > DELAY and not push.going:
            state = self._gather(state)
        if self.stay is None:
            return state
        carrying, change = self.stay.settled(state.carrying, end)
        state = replace(state, carrying=carrying)
        return self._afresh(replace(state, found=(*state.found, change))) if change else state

    def _belief(self, state: SlowState, bank: Bank, pool: Pool, other: bool) -> Belief:
        """What is believed of the states of the space in a moment.

        Args:
            bank: of which this is the healthy arm.
            other: it may be another program.
        """
        x, P = self.healthy.now(bank, pool.warm)
        straying = self._straying(state).window[: self.space.size]
        var = self.learning.window(state.learnt, pool.A) ** 2
        return x, P + np.diag(var + other * onsets.between_programs(straying) ** 2)

    def unsaid(self, state: SlowState, t: float) -> SlowState:
        """Without the moments since `t` [s] that are in no block yet: a sick sensor told them."""
        kept = sum(w.end <= t for w in state.waiting)
        carrying = replace(state.carrying, path=state.carrying.path[:kept])
        state = replace(state, waiting=state.waiting[:kept], carrying=carrying)
        return self._between(state)

    def _gather(self, state: SlowState) -> SlowState:
        if not np.isnan(state.begin) and onsets.another(state.end, state.waiting[0].begin):
            state = self._block(state)
        ripe, *waiting = state.waiting
        before = self._belief(state, state.before[0], ripe.pool, True)
        carrying, pool = self.loads.ripened(state.carrying, ripe, before)
        state = replace(state, carrying=carrying, waiting=tuple(waiting))
        if noticed := self._noticed(state):
            return noticed
        if pool is None:
            return state
        began = ripe.begin if np.isnan(state.begin) else state.begin
        if onsets.another(state.bank.t, began):
            fresh = replace(state.carrying, unclaimed=())
            state = replace(state, before=(state.bank, state.recall), carrying=fresh)
        state = replace(
            state,
            A=state.A + pool.A,
            b=state.b + pool.b,
            warm=state.warm + pool.warm,
            moments=state.moments + 1,
            begin=began,
            end=ripe.end,
        )
        return self._block(state) if ripe.end - began > BLOCK - MOMENT else state

    def _block(self, state: SlowState) -> SlowState:
        warm, straying = state.warm / state.moments, self._straying(state)
        belief = self.healthy.now(state.bank, warm)
        hidden = self.loads.hidden(state.A / state.moments, belief)
        window = np.hypot(self.learning.window(state.learnt, state.A), hidden)
        A, b = onsets.strayed(state.A, state.b, window)
        A, b = warmth.widened(A, b, warmth.unknowns(self.space, warm))
        unseen = np.append(hidden, np.zeros(len(b) - len(hidden)))
        block = Block(state.begin, state.end, A, b, self.healthy.blind(warm), unseen)
        state = replace(
            state,
            bank=onsets.step(state.bank, block, straying, self.E),
            learnt=self.learning.after(state.learnt, state.A, state.b, belief, straying.window),
            recall=state.recall.after(block, straying),
        )
        return self._judged(self._explained(self._between(state)))

    def _noticed(self, state: SlowState) -> SlowState | None:
        """With a light piece that is noticed by now: what this program taught is forgotten."""
        if not state.carrying.due:
            return None
        joints = [k for k, each in enumerate(self.of.each) if not each.kind.of_tool]
        rival = float(gathered(state.bank, self.of)[joints].max())
        carrying = self.loads.noticed(state.carrying, state.bank.t, rival)
        if carrying is None:
            return None
        bank, recall = state.before
        if state.known:
            bank = recall.again(self.healthy, state.known, self._straying(state), self.E)
        return self._between(replace(state, carrying=carrying, bank=bank, recall=recall))

    def _between(self, state: SlowState) -> SlowState:
        """With no block begun."""
        n, J = self.space.size, self.space.joints
        A, b, warm = np.zeros((n, n)), np.zeros(n), np.zeros((3, J))
        return replace(state, A=A, b=b, warm=warm, moments=0, begin=np.nan, end=np.nan)

    def _straying(self, state: SlowState) -> Straying:
        return self.healthy.loosened(state.known, state.learnt.steadiness.share)

    def _judged(self, state: SlowState) -> SlowState:
        """After a block: is there an alarm, and is it clear of what?"""
        evidence = gathered(state.bank, self.of)
        of = [k for k in range(len(self.of.each)) if k not in state.known]
        over = self.threshold + np.log(len(of))
        if logsumexp(evidence[of]) < over:
            return replace(state, waited=0)
        told = {
            k: explanation(state.bank, self.of.each[k]) for k in of if evidence[k] > over - NEAR
        }
        of = [k for k, each in told.items() if each.large]
        if not of or logsumexp(evidence[of]) < over:
            return replace(state, waited=0)
        state = replace(state, waited=state.waited + 1)
        share = np.exp(evidence[of] - logsumexp(evidence[of]))
        top = int(np.argmax(share))
        if share[top] < CONFIDENT and state.waited < PATIENCE:
            return state
        order = np.argsort(-share)[1:3]
        rivals = tuple((of[k], float(share[k])) for k in order)
        return self._accepted(state, of[top], told[of[top]], float(share[top]), rivals)

    def _accepted(
        self,
        state: SlowState,
        k: int,
        told: Explanation,
        share: float,
        rivals: tuple[tuple[int, float], ...],
    ) -> SlowState:
        more, of_tool = state.bank.x[self.healthy.payload], told.suspect.kind.of_tool
        detail = (state.carrying.modes[0].mean + more)[: len(PAYLOAD_STATES)]
        change = Change(
            k, told.onset, told.onset_lo, told.onset_hi, told.t, share, told.evidence,
            told.size, told.size_sd, told.rate, told.rate_sd,
            tuple(detail.tolist()) if of_tool else (), rivals,
        )  # fmt: skip
        state = replace(state, found=(*state.found, change), waited=0)
        if of_tool:
            return self._settled_on(state, more)
        return self._judged(self._knowing(state, (*state.known, k)))

    def _knowing(self, state: SlowState, known: tuple[int, ...]) -> SlowState:
        """With these suspects found, and the bank as it is in their light."""
        state = replace(state, known=known)
        bank = state.recall.again(self.healthy, known, self._straying(state), self.E)
        return replace(state, bank=bank)

    def _explained(self, state: SlowState) -> SlowState:
        """Without what was found of which others have left nothing: it was their shadow."""
        left = tuple(k for k in state.known if not self._nothing(state.bank, k))
        return state if left in ((), state.known) else self._knowing(state, left)

    def _nothing(self, bank: Bank, k: int) -> bool:
        """Whether a change that was found may as well be none by now."""
        at = self._measured(k)
        return bool(abs(bank.x[at]) < UNSURE * np.sqrt(bank.P[at, at]))

    def _settled_on(self, state: SlowState, more: Array) -> SlowState:
        """Take what is carried as what is carried as a rule; all else is known as it was."""
        first, *others = state.carrying.modes
        modes = (replace(first, mean=first.mean + more), *others)
        return self._afresh(replace(state, carrying=replace(state.carrying, modes=modes)))

    def _afresh(self, state: SlowState) -> SlowState:
        """Look for changes from here on, of an arm that carries what it carries now."""
        t, (x, P) = state.bank.t, self.healthy.emptied(state.bank.x, state.bank.P)
        bank = replace(onsets.first(x, P, self.E.shape[1]), t=t)
        recall = Recall(t, x, P)
        return replace(state, bank=bank, recall=recall, before=(bank, recall))

    def levels(self, state: SlowState) -> list[tuple[int, float, float]]:
        """Suspects that are found, and how far their change has gone by now: size, sd."""
        told = []
        for k in state.known:
            at = self._measured(k)
            told.append((k, float(state.bank.x[at]), float(np.sqrt(state.bank.P[at, at]))))
        return told

    def trace(self, state: SlowState, k: int) -> Series:
        """How a found change went in the blocks that are remembered: time, size, sd."""
        straying, at = self._straying(state), self._measured(k)
        return state.recall.trace(self.healthy, state.known, straying, at)

    def _measured(self, k: int) -> int:
        """Place of the state that measures a suspect's change."""
        return int(self.of.states[self.of.each[k].places[0]])
