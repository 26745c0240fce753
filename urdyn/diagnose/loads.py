"""Whose load a moment was, and which loads are there to stay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose import carried
from urdyn.diagnose.carried import Mode
from urdyn.diagnose.change import Change
from urdyn.diagnose.explain import Suspects, instant_evidence
from urdyn.diagnose.moment import Pool
from urdyn.diagnose.rules import SlowKind
from urdyn.diagnose.space import Space
from urdyn.types import Array, Index

MOMENT = 0.5  # [s]
LASTING = 0.2  # [-] of the time away that a load must have been carried to be there to stay
CERTAIN = 0.99  # [-] that what was carried for so long is another load
MARGIN = 3.0  # [nats] by which a payload has to explain a moment better than any fault of a joint

Belief = tuple[Array, Array]  # mean (n,) and covariance (n, n) of the states of the space


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
class Loads:
    """Settings."""

    space: Space
    of: Suspects
    kind: SlowKind | None  # that is a change of payload, if any

    @cached_property
    def payload(self) -> Index:
        """Places of what the tool carries."""
        at = self.space.places["payload"]
        return np.arange(at.start, at.stop)

    @cached_property
    def rest(self) -> Index:
        """Places of all others."""
        return np.setdiff1d(np.arange(self.space.size), self.payload)

    def unladen(self, ripe: Waiting) -> Pool:
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

    def carried(self, carrying: Carrying, belief: Belief, pool: Pool, t: float) -> Carrying:
        """Whose load the moment that ended at `t` [s] was."""
        rest, at = self.rest, self.payload
        x, P = belief
        told = carried.shown(pool, at, rest, x[rest], P[np.ix_(rest, rest)])
        modes, now = list(carrying.modes), carrying.now
        fits = [carried.fit(told, carried.spread(mode)) for mode in modes]
        best, new = int(np.argmax(fits)), carried.anything(t)
        gain = carried.fit(told, new) - fits[best]
        if gain > carried.SURE and gain > self._of_joints(belief, pool, modes[best]) + MARGIN:
            modes, now = carried.remembered(modes, carried.learnt(told, new, t))
        elif fits[best] > fits[now] + carried.SURE:
            now = best
        if now:
            modes[now] = carried.learnt(told, carried.spread(modes[now]), t)
        return _away(carrying, tuple(modes), now, t)

    def _of_joints(self, belief: Belief, pool: Pool, mode: Mode) -> float:
        """How well the best fault of a joint explains a moment, beside the healthy arm [nats]."""
        x, P, at = belief[0].copy(), belief[1].copy(), self.payload
        P[at] = P[:, at] = 0.0
        P[np.ix_(at, at)] = carried.spread(mode).cov
        x[at] = mode.mean
        keep = np.linalg.inv(np.eye(len(P)) + pool.A @ P)
        E = self.of.directions(len(x))
        C = E.T @ keep @ pool.A @ E
        d = E.T @ keep @ (pool.b - pool.A @ x)
        return instant_evidence(C, d, self.of)

    def settled(self, carrying: Carrying, t: float) -> tuple[Carrying, Change] | None:
        """Whether what is carried is there to stay: what is carried then, and the change."""
        if self.kind is None or not carrying.away:
            return None
        away = np.array(carrying.away)
        stays = int(np.argmin([m.mean[0] if s > LASTING * away.sum() else np.inf
                               for m, s in zip(carrying.modes, away, strict=True)]))  # fmt: skip
        mode, first = carrying.modes[stays], carrying.modes[0]
        more = mode.mean - first.mean
        hold = self.kind.hold_lighter if more[0] < 0.0 else self.kind.hold
        if away.sum() < hold or abs(more[0]) < self.kind.least:
            return None
        k = next(k for k, each in enumerate(self.of.each) if each.kind is self.kind)
        sd = float(np.sqrt(mode.cov[0, 0]))
        change = Change(
            k, carrying.since, carrying.since - 2.0 * MOMENT, carrying.since, t, CERTAIN, np.nan,
            float(more[0]), sd, 0.0, 0.0, tuple(mode.mean[:4].tolist()),
        )  # fmt: skip
        others = [m for j, m in enumerate(carrying.modes) if j not in (0, stays)]
        now = 0 if carrying.now == stays else 2 + others.index(carrying.modes[carrying.now])
        return Carrying((mode, first, *others), now), change


def _away(before: Carrying, modes: tuple[Mode, ...], now: int, t: float) -> Carrying:
    """How long the arm has not carried what it carries as a rule."""
    if not now:
        return Carrying(modes, 0)
    away = np.zeros(len(modes))
    if len(before.away) == len(modes):
        away[:] = before.away
    away[now] += MOMENT
    since = t - MOMENT if np.isnan(before.since) else before.since
    return Carrying(modes, now, tuple(away.tolist()), since)
