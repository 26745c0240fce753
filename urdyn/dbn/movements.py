"""Maximum likelihood of a network's movements: coefficients, and covariance of own parts.

With B the coefficients of the arrows, M the movements' second moments and S those of the residuals,

    2 L / N = -log |Sigma| - tr(Sigma⁻¹ S),    S = (1 - B) M (1 - B)ᵀ.

Given Sigma, the own parts' covariance, B is generalised least squares: components that move little
by themselves are most informative on their arrows. Given B, variances are those of the residuals;
where disturbances are shared, Sigma is found by Fisher scoring. Alternating, L never falls
[Meng1993]_.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.dbn.compile import Patterns, pattern
from urdyn.dbn.graph import Edge
from urdyn.types import Array, freeze

TURNS = 200  # iterations at most, as convergence is linear
SETTLED = 1e-6  # [nats] gain in likelihood below which iteration ends
TINY = 1e-12  # [-] of a component's movement: less is rounding, and gives no weight
NEARER = (1.0, 0.9, 0.5, 0.0)  # shares of pairwise correlations, until these are positive definite


@dataclass(frozen=True, eq=False)
class Movements:
    """Movements over some slices of nodes with places `at` among n states, led by `patterns`."""

    moments: Array  # (n, n) [1/s] M
    slices: int  # N
    at: Mapping[str, slice]
    patterns: Patterns

    def __post_init__(self) -> None:
        freeze(self, "moments")

    def likeliest(
        self, arrows: Sequence[Edge], shared: Sequence[Edge]
    ) -> tuple[list[Edge], list[Edge], Array]:
        """The arrows and shared disturbances with their coefficients, and Sigma, (n, n) [1/s]."""
        leads, one_way = self._blocks(arrows), self._blocks(shared)
        pairs = one_way + one_way.swapaxes(1, 2)
        best, c = -np.inf, np.array([edge.coefficient for edge in arrows])
        for _ in range(TURNS):
            left = self._left(c, leads)
            rho, sigma = _own(left, pairs)
            value = self.slices * _log_likelihood(sigma, left)
            if not arrows or value <= best + SETTLED:
                break
            best, c = value, self._led(leads, np.asarray(np.linalg.inv(sigma)))
        return _with(arrows, c), _with(shared, rho), sigma

    def _blocks(self, edges: Sequence[Edge]) -> Array:
        """Child states by parent states for each edge, (e, n, n)."""
        found = np.zeros((len(edges), *self.moments.shape))
        for block, edge in zip(found, edges, strict=True):
            places = self.at[edge.child], self.at[edge.parent]
            block[places] = pattern(edge.ends, self.at, self.patterns)
        return found

    def _left(self, c: Array, leads: Array) -> Array:
        """S, second moments of the own parts' movements, regularised, (n, n) [1/s]."""
        rest = np.eye(len(self.moments)) - np.tensordot(c, leads, 1)
        return np.asarray(rest @ self.moments @ rest.T + self._least)

    @cached_property
    def _least(self) -> Array:
        """What is added to S, so that it is invertible where an own part never moves, (n, n)."""
        moved = self.moments.diagonal()
        least = moved[moved > 0.0].min() if moved.any() else 1.0
        return np.diag(TINY * np.where(moved > 0.0, moved, least))

    def _led(self, leads: Array, weight: Array) -> Array:
        """The likeliest coefficients of arrows (e,), given Sigma⁻¹, (n, n)."""
        moved = leads @ self.moments
        normal = np.einsum("eij,fij->ef", weight @ moved, leads)
        right = np.einsum("ij,eij->e", weight, moved)
        scale = np.sqrt(normal.diagonal())
        scale = np.where(scale > 0.0, scale, 1.0)  # a parent that never moved is uninformative
        found = np.linalg.lstsq(normal / np.outer(scale, scale), right / scale)[0]
        return np.asarray(found / scale)


def _with(edges: Sequence[Edge], coefficients: Array) -> list[Edge]:
    pairs = zip(edges, coefficients.tolist(), strict=True)
    return [replace(edge, coefficient=c) for edge, c in pairs]


def _own(left: Array, pairs: Array) -> tuple[Array, Array]:
    """Maximum-likelihood correlations of shared disturbances, (s,), and Sigma, (n, n), given S."""
    rho, sigma = np.zeros(len(pairs)), np.diag(left.diagonal())
    touched = np.flatnonzero(pairs.any(axis=(0, 1)))
    if len(touched):
        both = np.ix_(touched, touched)
        few = pairs[:, touched[:, None], touched]
        sd, rho = _scored(left[both], few)
        sigma[both] = np.outer(sd, sd) * _correlation(rho, few)
    return rho, sigma


def _scored(S: Array, pairs: Array) -> tuple[Array, Array]:
    """Maximum-likelihood standard deviations (n,) and correlations (s,), given S and `pairs`.

    Args:
        S: (n, n) second moments.
        pairs: (s, n, n) which variables share each disturbance, symmetric.
    """
    n, sd = len(S), np.sqrt(S.diagonal())
    scale = np.einsum("sij,ij->s", pairs**2, np.outer(sd, sd))
    rho = np.einsum("sij,ij->s", pairs, S) / np.where(scale > 0.0, scale, 1.0)
    x = next(x for share in NEARER if _possible(x := np.r_[np.log(sd), share * rho], n, pairs))
    value = _value(x, S, pairs)
    for _ in range(TURNS):
        step, before = _step(x, S, pairs), value
        for share in 0.5 ** np.arange(20):
            tried = x + share * step
            if _possible(tried, n, pairs) and (value := _value(tried, S, pairs)) > before:
                x = tried
                break
        else:
            break
        if value - before < SETTLED**2:
            break
    return np.exp(x[:n]), x[n:]


def _step(x: Array, S: Array, pairs: Array) -> Array:
    """A step of Fisher scoring: inverse information times gradient of the likelihood."""
    n = len(S)
    sd, rho = np.exp(x[:n]), x[n:]
    sigma, each = np.outer(sd, sd) * _correlation(rho, pairs), np.arange(n)
    slopes = np.zeros((len(x), n, n))
    slopes[each, each, :] += sigma
    slopes[each, :, each] += sigma.T
    slopes[n:] = np.outer(sd, sd) * pairs
    through = np.linalg.solve(sigma, slopes)
    slope = np.einsum("kij,ji->k", through, np.linalg.solve(sigma, S) - np.eye(n))
    information = np.einsum("kij,lji->kl", through, through)
    return np.asarray(np.linalg.lstsq(information, slope)[0])


def _correlation(rho: Array, pairs: Array) -> Array:
    return np.asarray(np.eye(pairs.shape[1]) + np.tensordot(rho, pairs, 1))


def _possible(x: Array, n: int, pairs: Array) -> bool:
    """Whether the correlations are positive definite, safely enough to be inverted."""
    return bool(np.linalg.eigvalsh(_correlation(x[n:], pairs))[0] > TINY)


def _value(x: Array, S: Array, pairs: Array) -> float:
    sd = np.exp(x[: len(S)])
    return _log_likelihood(np.outer(sd, sd) * _correlation(x[len(S) :], pairs), S)


def _log_likelihood(sigma: Array, S: Array) -> float:
    """L / N, up to a constant."""
    root = np.linalg.cholesky(sigma)
    spread = 2.0 * np.log(root.diagonal()).sum()
    return float(-0.5 * (spread + np.trace(np.linalg.solve(sigma, S))))
