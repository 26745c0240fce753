"""Learning a healthy arm at work: how loud its residual is, and how steady the arm is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.kinds.rules import Noise
from urdyn.diagnose.residual.space import Space
from urdyn.diagnose.slow import loudness, steadiness
from urdyn.diagnose.slow.healthy import Healthy
from urdyn.diagnose.slow.loudness import Loudness
from urdyn.diagnose.slow.steadiness import Steadiness
from urdyn.types import Array

QUICK = 0.25  # [-] prior share of low-frequency noise in terms that reverse with the motion


@dataclass(frozen=True, eq=False)
class Learnt:
    """Learnt so far."""

    loudness: Loudness  # of terms that reverse with the motion
    level: Loudness  # of terms that do not
    steadiness: Steadiness


@dataclass(frozen=True, eq=False)
class Learning:
    """Learns from blocks how loud a healthy arm's noise is, and how steady the arm is."""

    space: Space
    healthy: Healthy

    def first(self, noise: Noise, period: float) -> Learnt:
        """Before any block."""
        loud = (self.space.slow / self.space.noise) ** 2
        loud = loud + noise.share * 2.0 * noise.lasting / period
        quick = loudness.first(1.0 + QUICK * (loud - 1.0))
        return Learnt(quick, loudness.first(loud), steadiness.by_the_rules(self.space.joints))

    def after(
        self, learnt: Learnt, A: Array, b: Array, belief: tuple[Array, Array], window: Array
    ) -> Learnt:
        """After a block.

        Args:
            A, b: its information, (n, n) and (n,).
            belief: mean (n,) and covariance (n, n) of the states before it.
            window: how far they stray from window to window, (n,).
        """
        x, P = belief
        off, var = _told(A, b, x, P)
        f = self.space.places["f"]
        usual = self.healthy.straying.window[f]

        def heard(before: Loudness, group: str) -> Loudness:
            """How loud the residual is, by a state of each joint."""
            at = self.space.places[group]
            noise = 1.0 / np.where(np.isnan(off[at]), np.nan, np.diag(A)[at])
            rest = var[at] - noise + window[at] ** 2
            expected, white = x[at], noise / learnt.loudness.power
            return loudness.heard(before, expected + off[at], expected, white, rest)

        return Learnt(
            loudness=heard(learnt.loudness, "f"),
            level=heard(learnt.level, "o"),
            steadiness=steadiness.learnt(learnt.steadiness, off[f], np.sqrt(var[f]), usual),
        )

    def window(self, learnt: Learnt, A: Array) -> Array:
        """How far the states stray from window to window in some rows, (n,).

        Args:
            A: their information, (n, n).
        """
        information, quick = np.diag(A)[self.space.places["o"]], learnt.loudness.power
        known = information > 0.0
        white = np.where(known, 1.0 / np.where(known, information, 1.0), 0.0) / quick
        level = np.sqrt(np.maximum(learnt.level.power - quick, 0.0) * white)
        return self.healthy.window(learnt.steadiness.share, level)


def _told(A: Array, b: Array, x: Array, P: Array) -> tuple[Array, Array]:
    """A block's estimate of a shift of each state alone, and its variance, (n,)."""
    keep = np.linalg.inv(np.eye(len(P)) + A @ P)
    C, d = np.diag(keep @ A), keep @ (b - A @ x)
    C = np.where(C > 0.0, C, np.nan)
    return d / C, 1.0 / C
