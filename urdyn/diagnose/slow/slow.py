"""Slow kinds: moments in, changes out.

A moment, half a second, is first assigned its load; then, with a passing payload marginalised, its
information about joints, links and tool joins the block that the bank processes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.kinds.change import Change, Push
from urdyn.diagnose.kinds.rules import Rules
from urdyn.diagnose.kinds.suspects import Suspects, suspects
from urdyn.diagnose.load import carried
from urdyn.diagnose.load.carrying import MOMENT, Carrying, Waiting
from urdyn.diagnose.load.given_load import Belief
from urdyn.diagnose.load.lasting_load import LastingLoad
from urdyn.diagnose.load.loads import DELAY, Believed, Loads
from urdyn.diagnose.residual import friction, warmth
from urdyn.diagnose.residual.gathering import Gathering, none_gathered
from urdyn.diagnose.residual.moment import Pool, averaged, pooled
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.space import Space
from urdyn.diagnose.slow import onsets
from urdyn.diagnose.slow.alarm import CONFIDENT
from urdyn.diagnose.slow.explanation import gathered, ratios
from urdyn.diagnose.slow.healthy import Healthy
from urdyn.diagnose.slow.judge import Judge
from urdyn.diagnose.slow.learning import Learning
from urdyn.diagnose.slow.onsets import Bank, Block
from urdyn.diagnose.slow.recall import Recall
from urdyn.diagnose.slow.slow_state import LearntBy, SlowState
from urdyn.types import Array

BLOCK = 5.0  # [s]
HEARD = 12  # blocks, a minute, for which learnt noise can be undone
ENOUGH = 10  # values of current that a moment needs to count


@dataclass(frozen=True, eq=False)
class Slow:
    """Tests for slow kinds: moments in, changes out."""

    space: Space
    period: float  # [s] between rows
    rules: Rules

    @cached_property
    def of(self) -> Suspects:
        """Everything tested for."""
        return suspects(self.space, self.rules.slow_of(self.space.reference))

    @cached_property
    def healthy(self) -> Healthy:
        """The healthy arm."""
        return Healthy(self.space, self.rules, self.of)

    @cached_property
    def learning(self) -> Learning:
        """What is learnt about it."""
        return Learning(self.space, self.healthy)

    @cached_property
    def loads(self) -> Loads:
        """What the tool carries."""
        return Loads(self.space, self.of)

    @cached_property
    def lasting(self) -> LastingLoad | None:
        """Decides which load lasts, if the rules test for that."""
        kind = next((each.kind for each in self.of.each if each.kind.of_tool), None)
        return LastingLoad(self.space, self.of, kind) if kind else None

    @cached_property
    def judge(self) -> Judge:
        """Judges the bank after a block."""
        blocks = 3600.0 / BLOCK
        return Judge(self.healthy, self.of, self.rules.hours * blocks, self.rules.shift * blocks)

    def init(self) -> SlowState:
        """The state before the first moment."""
        x, P = self.healthy.first
        bank, recall = onsets.first(x, P, self.judge.E.shape[1]), Recall(np.nan, x, P)
        return SlowState(
            bank=bank,
            gathering=none_gathered(self.space.size, self.space.joints),
            waiting=(),
            heard=(LearntBy(-np.inf, self.learning.first(self.rules.noise, self.period)),),
            carrying=Carrying((carried.commissioned(),)),
            recall=recall,
            before=(bank, recall),
        )

    def moment(self, state: SlowState, rows: Rows, push: Push) -> SlowState:
        """Process one moment; `found` are the changes that it settles."""
        state = _unpushed(replace(state, found=()), push)
        noise = self.space.noise * np.sqrt(state.learnt.loudness.power)
        means, begin, end = averaged(rows, self.period, noise), float(rows.t[0]), float(rows.t[-1])
        if means.count.sum() < ENOUGH:
            return state
        if not push.within(begin, end):
            long = len(rows) * self.period
            moment = Waiting(means, pooled(means), told=(), begin=begin, end=end, long=long)
            state = self._waiting(state, moment)
        while len(state.waiting) > DELAY and not push.going:
            state = self._gather(state)
        return self._settled(state, end)

    def concluded(self, state: SlowState, push: Push) -> SlowState:
        """The state at a recording's end; `found` are the changes that this settles."""
        last = state.waiting[-1].end if state.waiting else state.gathering.end
        state = _unpushed(replace(state, found=()), push)
        # What pushes just now may have done so in the waiting moments too.
        told = self.judge.concluded(state if push.going else self._told_out(state))
        # What is carried is decided with the waiting moments.
        told = replace(told, carrying=state.carrying, waiting=state.waiting)
        return self._settled(told, last, ended=True)

    def _told_out(self, state: SlowState) -> SlowState:
        """Process the waiting moments, and a last block if half full: no more will come."""
        while state.waiting:
            state = self._gather(state)
        return self._block(state) if state.gathering.moments * MOMENT >= 0.5 * BLOCK else state

    def _settled(self, state: SlowState, t: float, ended: bool = False) -> SlowState:
        """Settle the load that is carried, if it lasts."""
        if self.lasting is None:
            return state
        carrying, change = self.lasting.settled(state.carrying, t, ended)
        if not change:
            return replace(state, carrying=carrying)
        # A joint's fault that began just before may have been mistaken for it.
        until = carrying.since if carrying.away else np.inf  # the next is judged later
        if share := self.judge.shares(state, state.recall.unladen(change.onset, until)):
            load = share[change.suspect]
            if load < (0.5 if ended else 1.0 - CONFIDENT):
                return self._withdrawn(state, ended)
            if load < CONFIDENT and not ended:
                return state
            change = change.among(share)
        more = carrying.modes[0].mean - state.carrying.modes[0].mean
        change = _unhidden(change, state)
        state = replace(state, carrying=carrying, found=(*state.found, change))
        state = self.judge.relieved(state, more, change.onset, until)
        return self._settled(state, t, ended) if carrying.away else state

    def _withdrawn(self, state: SlowState, ended: bool) -> SlowState:
        """As if the usual load had been carried since the other one came."""
        carrying = state.carrying
        alone = len(carrying.modes) == 2  # the load before was the same, no piece
        recall = state.recall.unladen(-np.inf if alone else carrying.since)
        state = replace(state, gathering=state.gathering.unladen, recall=recall)
        state = self.judge.knowing(replace(state, carrying=carrying.unladen), state.known)
        state = self._retold(self.judge.judged(state))
        return self.judge.concluded(state) if ended else state

    def _waiting(self, state: SlowState, moment: Waiting) -> SlowState:
        """Add a waiting moment."""
        believed = self._believed(state)
        moment = self.loads.given.told(moment, believed(moment), state.carrying.modes)
        carrying, waiting = self.loads.carried(state.carrying, believed, (*state.waiting, moment))
        return replace(state, waiting=waiting, carrying=carrying)

    def _believed(self, state: SlowState) -> Believed:
        """The belief in waiting moments, supposing the change that explains the bank best."""
        bank = self.judge.supposed(state)

        def believed(moment: Waiting) -> Belief:
            other = onsets.another(state.bank.t, moment.begin)
            return self._belief(state, bank, moment.pool, other)

        return believed

    def _belief(self, state: SlowState, bank: Bank, pool: Pool, other: bool) -> Belief:
        """The belief about the states of the space in a moment.

        Args:
            bank: whose healthy arm it is.
            other: the moment may be of another program.
        """
        x, P = self.healthy.now(bank, pool.warm)
        straying = state.arm(self.healthy).straying.window[: self.space.size]
        var = self.learning.window(state.learnt, pool.A) ** 2
        return x, P + np.diag(var + other * onsets.between_programs(straying) ** 2)

    def unsaid(self, state: SlowState, t: float) -> SlowState:
        """Drop the information since `t` [s]: from a faulty sensor, or a gear with backlash."""
        kept = sum(w.end <= t for w in state.waiting)
        carrying = replace(state.carrying, path=state.carrying.path[:kept])
        state = replace(state, waiting=state.waiting[:kept], carrying=carrying)
        recall = state.recall.until(t)
        if recall is not state.recall:
            state = self._recalled(state.unheard(t), recall)
        return self._between(state)

    def _recalled(self, state: SlowState, recall: Recall) -> SlowState:
        """Use these blocks alone; faults that began since may be of any size."""
        last, now = recall.blocks[-1].end if recall.blocks else recall.t, state.bank.t
        known = tuple(f if f.onset_hi < last else f.by(now) for f in state.known)
        state = replace(state, known=known)
        bank = recall.again(state.arm(self.healthy), self.judge.E)
        return replace(state, bank=bank, recall=recall)

    def _gather(self, state: SlowState) -> SlowState:
        begun = state.gathering
        if begun.moments and onsets.another(begun.end, state.waiting[0].begin):
            state = self._block(state)
        ripe, *waiting = state.waiting
        bank = state.arm(self.healthy).informed(state.before[0], state.bank)
        before = self._belief(state, bank, ripe.pool, True)
        carrying, pool = self.loads.ripened(state.carrying, ripe, before)
        state = replace(state, carrying=carrying, waiting=tuple(waiting))
        if noticed := self._noticed(state):
            return noticed
        if pool is None:
            return state
        gathering = state.gathering
        if carrying.was:
            usual = self.loads.given.pool(ripe, carrying.modes[0].mean)
            gathering = gathering.bearing(usual, pool)
        lost = friction.lost(ripe.means, self.space.reference.drive)
        gathering = gathering.after(pool, ripe.begin, ripe.end, lost)
        if onsets.another(state.bank.t, gathering.begin):
            fresh = replace(state.carrying, unclaimed=())
            state = replace(state, before=(state.bank, state.recall), carrying=fresh)
        state = replace(state, gathering=gathering)
        whole = gathering.end - gathering.begin > BLOCK - MOMENT
        return self._block(state) if whole else state

    def _block(self, state: SlowState) -> SlowState:
        gathering, arm = state.gathering, state.arm(self.healthy)
        warm = gathering.warmth
        belief = self.healthy.now(state.bank, warm)
        supposed = self.healthy.now(self.judge.supposed(state), warm)
        hidden = self.loads.hidden(gathering.unladen.A / gathering.moments, belief)
        block = self._block_of(state, gathering.A, gathering.b, hidden)
        if gathering.laden:
            usual = gathering.unladen
            bare = self._block_of(state, usual.A, usual.b, np.zeros_like(hidden))
            # What its moments tell without that load is not kept: taken to be even over it.
            block = replace(block, unladen=replace(bare, since=None))
        block = arm.leaping(block)
        window = arm.straying.window
        learnt = self.learning.after(state.learnt, gathering.A, gathering.b, supposed, window)
        state = replace(
            state,
            bank=onsets.step(state.bank, block, arm.straying, self.judge.E, state.waited > 0),
            heard=(*state.heard, LearntBy(block.end, learnt))[-HEARD:],
            recall=state.recall.after(block, arm),
        )
        judged = self._retold(self.judge.judged(self._between(state)))
        if judged.known == state.known:
            return judged
        # Moments searched for a light piece are not kept to be re-evaluated.
        return replace(judged, carrying=replace(judged.carrying, unclaimed=()))

    def _block_of(self, state: SlowState, A: Array, b: Array, hidden: Array) -> Block:
        """The block of its moments' information, A (n, n) and b (n,).

        Args:
            hidden: sd of an undetected load's effect, (n,).
        """
        gathering = state.gathering
        warm, window = gathering.warmth, self.learning.window(state.learnt, gathering.A)
        A, b = onsets.strayed(A, b, np.hypot(window, hidden))
        A, b = warmth.widened(A, b, warmth.unknowns(self.space, warm))
        unseen = np.append(hidden, np.zeros(len(b) - len(hidden)))
        walk = self.healthy.blind(warm)
        begin, end, lost = gathering.begin, gathering.end, gathering.lost
        return Block(begin, end, A, b, walk, unseen, lost=lost, since=self._since(gathering))

    def _since(self, gathering: Gathering) -> Array:
        """How faults that begin within a block show in it, as `Block.since` has it."""
        E, n = self.judge.E, self.space.size
        lasting = gathering.end - gathering.begin
        shown = np.zeros((len(onsets.WITHIN) - 1, *E.shape))  # none in the unknowns of warmth
        within = gathering.begin + lasting * np.array(onsets.WITHIN[1:])
        shown[:, :n] = gathering.since(within) @ E[:n]
        return shown

    def _retold(self, state: SlowState) -> SlowState:
        """Re-evaluate the waiting moments given what is known by now."""
        believed, modes = self._believed(state), state.carrying.modes
        told = (self.loads.given.told(w, believed(w), modes) for w in state.waiting)
        return replace(state, waiting=tuple(told))

    def _noticed(self, state: SlowState) -> SlowState | None:
        """Notice a light piece that shows by now: what was learnt in this program is dropped."""
        if not state.carrying.due:
            return None
        ended = self._block(state) if state.gathering.moments else state
        if ended.known != state.known:  # apparently a fault, no light piece
            return None
        joints = [k for k, each in enumerate(self.of.each) if not each.kind.of_tool]
        rival = float(gathered(ended.bank, ratios(ended.bank, self.of))[joints].max())
        carrying = self.loads.noticed(state.carrying, state.bank.t, rival)
        if carrying is None:
            return None
        bank, recall = state.before
        if np.isnan(recall.t):  # what shows from now on may have begun within the run
            now = state.bank.t
            bank, recall = replace(bank, t=now, oldest=False), replace(recall, t=now)
        state = replace(state, carrying=carrying)
        if state.known:
            return self._between(self._recalled(state, recall))
        return self._between(replace(state, bank=bank, recall=recall))

    def _between(self, state: SlowState) -> SlowState:
        """The state with no block begun."""
        return replace(state, gathering=none_gathered(self.space.size, self.space.joints))


def _unpushed(state: SlowState, push: Push) -> SlowState:
    """Drop the waiting moments in which something pushed the arm."""
    kept = [k for k, w in enumerate(state.waiting) if not push.within(w.begin, w.end)]
    path = tuple(state.carrying.path[k] for k in kept)
    waiting = tuple(state.waiting[k] for k in kept)
    return replace(state, waiting=waiting, carrying=replace(state.carrying, path=path))


def _unhidden(change: Change, state: SlowState) -> Change:
    """A load's change, which a joint's fault may have hidden since before it seems to begin.

    Between its onset and its alarm a fault makes a load look lighter, or put down: the load came
    after the last block before that began with the usual one.
    """
    blind = [f.onset_lo for f in state.known if f.onset_lo < change.onset < f.alarm]
    before = [b for b in state.recall.blocks if b.begin < min(blind, default=-np.inf)]
    if not before:
        return change
    usual = max((b.begin for b in before if b.unladen is None), default=before[0].begin)
    onset = min((b.begin for b in before if b.begin > usual), default=change.onset)
    return replace(change, onset=onset, began=(min(usual, change.began[0]), change.began[1]))
