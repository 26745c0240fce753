"""Whose load a moment was, and what it says of the arm beside that load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose import carried, pieces
from urdyn.diagnose.carried import Mode, Shown
from urdyn.diagnose.carrying import Carrying, Waiting
from urdyn.diagnose.explain import Suspects, instant_evidence
from urdyn.diagnose.moment import Means, Pool, laden, pooled
from urdyn.diagnose.space import Space
from urdyn.types import Array, Index

DELAY = 4  # moments that one waits
MARGIN = 10.0  # [nats] by which a payload has to explain moments better than any fault of a joint

Belief = tuple[Array, Array]  # mean (n,) and covariance (n, n) of the states of the space


@dataclass(frozen=True, eq=False)
class Loads:
    """Settings."""

    space: Space
    of: Suspects

    @cached_property
    def rest(self) -> Index:
        """Places of all others."""
        return np.setdiff1d(np.arange(self.space.size), self.space.payload)

    @cached_property
    def _rests(self) -> tuple[Index, Index]:
        return self.rest[:, None], self.rest[None]

    def unladen(self, moment: Waiting, mode: Mode, usual: bool) -> Pool:
        """What a moment says of all states; of the payload nothing while another one is carried.

        Args:
            usual: the mode is what is carried as a rule.
        """
        at, pool = self.space.payload, moment.pool
        if mode.mean.any():
            pool = pooled(laden(moment.means, self.space.reference.drive, mode.mean))
        if usual:
            return pool
        cov = carried.alike(carried.spread(mode)).cov
        cross = pool.A[:, at]
        inner = np.linalg.solve(np.eye(len(at)) + cov @ pool.A[np.ix_(at, at)], cov)
        A = pool.A - cross @ inner @ cross.T
        b = pool.b - cross @ inner @ pool.b[at]
        A[at] = A[:, at] = b[at] = 0.0
        return replace(pool, A=0.5 * (A + A.T), b=b)

    def waiting(
        self, means: Means, pool: Pool, belief: Belief, begin: float, end: float
    ) -> Waiting:
        """A moment that is over."""
        return Waiting(means, pool, self.shown(pool, belief), begin, end)

    def shown(self, pool: Pool, belief: Belief) -> Shown:
        """What a moment says of the load."""
        x, P = belief
        return carried.shown(pool, self.space.payload, self.rest, x[self.rest], P[self._rests])

    def carried(self, carrying: Carrying, belief: Belief, moments: Sequence[Waiting]) -> Carrying:
        """Whose loads these moments were: the likeliest path through modes, or a new one."""
        modes = carrying.modes
        fits = np.array([[carried.fit(w.told, carried.spread(m)) for m in modes] for w in moments])
        score, path = likeliest(fits, carrying.was)
        befores = [likeliest(fits[:k], carrying.was)[0] if k else 0.0 for k in range(len(moments))]
        new = self._new(moments, score - np.array(befores), belief, [modes[k] for k in path])
        if new is None:
            return replace(carrying, now=path[-1], path=path)
        k, mode = new
        more, now = carried.remembered(modes, mode, {carrying.was, *path[:k]})
        path = (*path[:k], *[now] * (len(moments) - k))
        return replace(carrying, modes=more, now=now, path=path)

    def _new(
        self, moments: Sequence[Waiting], known: Array, belief: Belief, modes: Sequence[Mode]
    ) -> tuple[int, Mode] | None:
        """The load that explains moments better than what is known and any fault of a joint.

        Args:
            known: how well modes explain the moments from each one on, (N,) [nats].
            modes: those that do, moment by moment.

        Returns:
            The first of its moments, and the load; None where there is none.
        """
        t = moments[-1].end
        tolds = [carried.together([w.told for w in moments[k:]]) for k in range(len(moments))]
        gain = np.array([carried.fit(told, carried.anything(t)) for told in tolds]) - known
        if gain.max() <= carried.SURE:
            return None
        joints = self._of_joints(belief, [w.pool for w in moments], modes)
        for k in np.flatnonzero(gain > np.maximum(carried.SURE, joints + MARGIN)).tolist():
            new = carried.learnt(tolds[k], carried.anything(t), t)
            if carried.possible(new, self.space.reference.payload):
                return k, new
        return None

    def ripened(
        self, carrying: Carrying, ripe: Waiting, before: Belief
    ) -> tuple[Carrying, Pool | None]:
        """The first moment that waits is told for good, and what it says of the arm.

        Nothing where a piece may have been taken or put down meanwhile.

        Args:
            before: belief before this program.
        """
        mode, *path = carrying.path
        modes, whole = list(carrying.modes), {carrying.was, mode, *path[:1]} == {mode}
        if mode:
            modes[mode] = carried.learnt(ripe.told, carried.spread(modes[mode]), ripe.end)
        pool = self.unladen(ripe, modes[mode], not mode) if whole else None
        carrying = replace(carrying, modes=tuple(modes), was=mode, path=tuple(path))
        return carrying.on(ripe, self.shown(ripe.pool, before)), pool

    def noticed(self, carrying: Carrying, t: float, rival: float) -> Carrying | None:
        """With a piece that no moment told, but many do; None where there is none.

        Args:
            rival: evidence of the best fault of a joint [nats].
        """
        new, gain = pieces.unseen(carrying.unclaimed, carrying.modes[0], t)
        if gain < carried.SURE + max(rival, 0.0):
            return None
        if not carried.possible(new, self.space.reference.payload):
            return None
        more, _ = carried.remembered(carrying.modes, new, {carrying.was, *carrying.path})
        return replace(carrying, modes=more, unclaimed=())

    def _of_joints(self, belief: Belief, pools: Sequence[Pool], modes: Sequence[Mode]) -> Array:
        """How well a fault of a joint explains moments, beside the healthy arm, (N,) [nats].

        The best fault that began with each moment or later. As those of a load, each moment stands
        for itself: the arm may stray anew in every one.
        """
        at, E = self.space.payload, self.of.directions(len(belief[0]))
        C, d = np.zeros((E.shape[1], E.shape[1])), np.zeros(E.shape[1])
        best = []
        for pool, mode in zip(reversed(pools), reversed(modes), strict=True):
            x, P = belief[0].copy(), belief[1].copy()
            P[at] = P[:, at] = 0.0
            P[np.ix_(at, at)] = carried.spread(mode).cov
            x[at] = mode.mean
            of = np.linalg.solve(np.eye(len(P)) + P @ pool.A, E)  # (I + P A)^-1 E
            C, d = C + E.T @ pool.A @ of, d + of.T @ (pool.b - pool.A @ x)
            best.append(instant_evidence(C, d, self.of))
        return np.asarray(np.maximum.accumulate(best)[::-1])

    def hidden(self, A: Array, belief: Belief) -> Array:
        """How far what is carried strays by pieces that come and go unseen, sd (n,).

        A piece is seen where the moments that wait tell it by SURE + MARGIN; a lighter one is in
        the gripper half of the time, which puts half of it on every program and block.

        Args:
            A: information in a moment, (n, n).
        """
        at, told = self.space.payload, self.shown(Pool(A, np.zeros(len(A)), np.zeros(0)), belief).C
        unsure = np.diag(np.linalg.inv((DELAY + 1) * told + np.diag(carried.ANYTHING**-2.0)))
        sd = np.zeros(len(A))
        most = np.sqrt(2.0 * (carried.SURE + MARGIN) * unsure)
        sd[at] = 0.5 * np.minimum(most, carried.ANYTHING)
        return sd


def likeliest(fits: Array, was: int) -> tuple[float, tuple[int, ...]]:
    """The likeliest path through modes [Viterbi1967]_, and its log-likelihood.

    Args:
        fits: of moments under modes, (N, K) [nats].
        was: mode before the first.
    """
    other = np.where(np.arange(fits.shape[1]) == was, 0.0, -carried.CHANGED)
    score, back = other + fits[0], []
    for row in fits[1:]:
        best = int(np.argmax(score))
        moved = score < score[best] - carried.CHANGED
        back.append(np.where(moved, best, np.arange(len(row))))
        score = np.maximum(score, score[best] - carried.CHANGED) + row
    path = [int(np.argmax(score))]
    for step in reversed(back):
        path.append(int(step[path[-1]]))
    return float(score.max()), tuple(reversed(path))
