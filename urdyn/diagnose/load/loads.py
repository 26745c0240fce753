"""Which load a moment belongs to: that of a known mode, or of a new one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.kinds.likelihood_ratio import instant_evidence
from urdyn.diagnose.kinds.suspects import Suspects
from urdyn.diagnose.load import carried, pieces
from urdyn.diagnose.load.carried import Mode
from urdyn.diagnose.load.carrying import Carrying, Waiting
from urdyn.diagnose.load.given_load import Belief, GivenLoad
from urdyn.diagnose.residual.moment import Pool
from urdyn.diagnose.residual.space import Space
from urdyn.types import Array

DELAY = 4  # moments that one waits
Believed = Callable[[Waiting], Belief]  # in that moment, its own straying included
# [nats] in the waiting moments: a piece as clear as this would already have been found in them.
HEAVY = 44.0
MARGIN = 10.0  # [nats] by which a payload must explain moments better than any fault of a joint


@dataclass(frozen=True, eq=False)
class Loads:
    """Assigns every moment to a load."""

    space: Space
    of: Suspects

    @cached_property
    def given(self) -> GivenLoad:
        """The information in moments."""
        return GivenLoad(self.space)

    def carried(
        self, carrying: Carrying, believed: Believed, moments: tuple[Waiting, ...]
    ) -> tuple[Carrying, tuple[Waiting, ...]]:
        """The loads of these moments: the likeliest path through modes, or a new one."""
        modes = carrying.modes
        fits = np.array([[_fit(w, m) for m in modes] for w in moments])
        score, path = self._path(fits, carrying.was, believed, moments, modes)
        starts = range(len(moments))
        known = [score - (likeliest(fits[:k], carrying.was)[0] if k else 0.0) for k in starts]
        new = self._new(moments, np.array(known), believed, [modes[k] for k in path])
        if new is None:
            return replace(carrying, now=path[-1], path=path), moments
        k, mode, later = new
        more, now = carried.remembered(modes, mode, {carrying.was, *path[:k]})
        path = (*path[:k], *[now] * len(later))
        if now < len(modes):
            carrying = carrying.without(now)
        return replace(carrying, modes=more, now=now, path=path), (*moments[:k], *later)

    def _path(
        self,
        fits: Array,
        was: int,
        believed: Believed,
        moments: Sequence[Waiting],
        modes: Sequence[Mode],
    ) -> tuple[float, tuple[int, ...]]:
        """The likeliest path through modes, and its log-likelihood.

        Where a fault of a joint that begins meanwhile explains more than another load, the load
        stays: a fault may resemble a known load in some poses, and would be halved by it.

        Args:
            fits: of moments under modes, (N, K) [nats].
            was: mode before the first.
        """
        score, path = likeliest(fits, was)
        stays, stayed = (was,) * len(moments), float(fits[:, was].sum())

        def fault(path: Sequence[int]) -> float:
            told = self._of_joints(believed, moments, [modes[k] for k in path])[0]
            return max(float(told) - carried.SURE, 0.0)

        if path != stays and (more := stayed + fault(stays) - score) > 0.0 and more > fault(path):
            return stayed, stays
        return score, path

    def _new(
        self, moments: tuple[Waiting, ...], known: Array, believed: Believed, modes: Sequence[Mode]
    ) -> tuple[int, Mode, tuple[Waiting, ...]] | None:
        """The load that explains moments better than the known ones and any fault of a joint.

        It begins where it explains most.

        Args:
            known: how well modes explain all moments from each one on, (N,) [nats].
            modes: these modes, moment by moment.

        Returns:
            The first of its moments, the load, and the moments from there on with their information
            near it; None where there is none.
        """
        starts = range(len(moments))
        gains = np.array([_anything(moments[k:], modes[k])[0] for k in starts]) - known
        if gains.max() <= carried.SURE:
            return None
        needed = np.maximum(carried.SURE, self._of_joints(believed, moments, modes) + MARGIN)
        clear = [k for k in starts if gains[k] > needed[k]] or [0]
        for k in sorted(clear, key=lambda k: -gains[k]):
            score, new, later = self._begun(moments[k:], modes[k], believed)
            if score - known[k] > needed[k] and _as_the_others(later, new):
                found = carried.possible(new, self.space.reference.payload)
                return (k, new, later) if found else None
        return None

    def _begun(
        self, moments: tuple[Waiting, ...], mode: Mode, believed: Believed
    ) -> tuple[float, Mode, tuple[Waiting, ...]]:
        """The load of all these moments, and how well it explains them, linearised near it."""
        guess = _anything(moments, mode)[1].mean
        told = (self.given.shown(w, believed(w), guess) for w in moments)
        near = tuple(replace(w, told=(*w.told, t)) for w, t in zip(moments, told, strict=True))
        return *_anything(near, replace(mode, mean=guess)), near

    def ripened(
        self, carrying: Carrying, ripe: Waiting, before: Belief
    ) -> tuple[Carrying, Pool | None]:
        """Settle the first waiting moment, and give its information about the arm.

        None where a piece may have been taken or put down meanwhile.

        Args:
            before: belief before this program.
        """
        mode, *path = carrying.path
        modes, whole = list(carrying.modes), {carrying.was, mode, *path[:1]} == {mode}
        if mode:
            told = carried.nearest(ripe.told, modes[mode].mean)
            modes[mode] = carried.learnt(told, carried.spread(modes[mode]), ripe.end)
        near = self.given.pool(ripe, modes[mode].mean)
        pool = self.given.unladen(near, modes[mode], not mode) if whole else None
        carrying = replace(carrying, modes=tuple(modes), was=mode, path=tuple(path))
        if mode:
            carrying = self._weighed(carrying, near.A, before)
        return carrying.on(ripe, self.given.said(near, before, modes[mode].mean)), pool

    def _weighed(self, carrying: Carrying, A: Array, before: Belief) -> Carrying:
        """With one more moment of that load, A (n, n)."""
        A = A if carrying.whole is None else carrying.whole + A
        return replace(
            carrying, whole=A, weighed=float(np.sqrt(self.given.unsure(A, before, 1)[0]))
        )

    def noticed(self, carrying: Carrying, t: float, rival: float) -> Carrying | None:
        """With a piece that no single moment shows, but many do; None where there is none.

        It need not beat a fault of a joint by a margin: pieces are common.

        Args:
            rival: evidence of the best fault of a joint [nats].
        """
        told, first = carrying.unclaimed, carrying.modes[0]
        new, gain = pieces.unseen(told, first, t)
        heavy = pieces.at_most(new, told, first, DELAY + 1) > HEAVY
        if heavy or gain < max(carried.SURE, rival):
            return None
        if not carried.possible(new, self.space.reference.payload):
            return None
        more, _ = carried.remembered(carrying.modes, new, {carrying.was, *carrying.path})
        return replace(carrying, modes=more, unclaimed=())

    def _of_joints(
        self, believed: Believed, moments: Sequence[Waiting], modes: Sequence[Mode]
    ) -> Array:
        """How well a fault of a joint explains moments, against the healthy arm, (N,) [nats].

        The best fault that began with each moment or later. As for loads, moments are
        independent: the arm may stray anew in each.
        """
        at, E = self.space.payload, self.of.directions(self.space.size)
        C, d = np.zeros((E.shape[1], E.shape[1])), np.zeros(E.shape[1])
        best = []
        for moment, mode in zip(reversed(moments), reversed(modes), strict=True):
            pool = self.given.pool(moment, mode.mean)
            x, P = (np.array(of) for of in believed(moment))
            P[at] = P[:, at] = 0.0
            P[np.ix_(at, at)] = carried.spread(mode).cov
            x[at] = 0.0
            of = np.linalg.solve(np.eye(len(P)) + P @ pool.A, E)  # (I + P A)^-1 E
            C, d = C + E.T @ pool.A @ of, d + of.T @ (pool.b - pool.A @ x)
            best.append(instant_evidence(C, d, self.of))
        return np.asarray(np.maximum.accumulate(best)[::-1])

    def hidden(self, A: Array, belief: Belief) -> Array:
        """How far undetected pieces that come and go make the load stray, sd (n,).

        A piece is detected where the waiting moments show it by SURE + MARGIN; a lighter one is in
        the gripper half of the time, which puts half of it on every program and block.

        Args:
            A: information in a moment, (n, n).
        """
        unsure = self.given.unsure(A, belief, DELAY + 1)
        sd = np.zeros(len(A))
        most = np.sqrt(2.0 * (carried.SURE + MARGIN) * unsure)
        sd[self.space.payload] = 0.5 * np.minimum(most, carried.ANYTHING)
        return sd


def _fit(moment: Waiting, mode: Mode) -> float:
    """Log-likelihood of a moment under a mode, up to a constant."""
    return carried.fit(carried.nearest(moment.told, mode.mean), carried.spread(mode))


def _anything(moments: Sequence[Waiting], mode: Mode) -> tuple[float, Mode]:
    """How well an unknown load explains moments [nats], and its estimate.

    Args:
        mode: load near which they are linearised.
    """
    anything = carried.anything(moments[-1].end)
    told = carried.together([carried.nearest(w.told, mode.mean) for w in moments])
    return carried.fit(told, anything), carried.learnt(told, anything, anything.seen)


def _as_the_others(moments: Sequence[Waiting], mode: Mode) -> bool:
    """Whether the first moment has the others' load, rather than the jolt that brought it.

    Args:
        mode: load near which they are linearised.
    """
    first, *others = moments
    if not others:
        return True
    load = _anything(others, mode)[1]
    return _fit(first, load) > _anything([first], mode)[0] - carried.SURE


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
