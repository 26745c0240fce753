"""A stream that shares a few states with the currents, and has others of its own.

The poses of a tracker share the joints' zeros with the currents; no current shows where the tracker
stands, what target it looks at and how the arm is built. Given the shared states, the rest of
either side is independent of the other's (d-separation in the network), so that the joint belief is

    p(x, s) = p(x) p(s | z),    s - point | z ~ N(L (z - about), cov),    z = x[shared]

and neither filter grows by the other's states. An observation e = y - h of both,

    e = Hs (s - point) + Hz (z - about) + noise R,

is to the currents' filter a measurement of z alone, with A = Hs L + Hz and N = Hs cov Hsᵀ + R, and

    K = cov Hsᵀ N⁻¹,    point += K e,    L -= K A,    cov -= K Hs cov.

That is exactly the joint Kalman update. While z strays by itself, z' = kept z + w, w ~ N(0, Q),
p(s | z') follows from p(s | z) and the belief in z; only the dependence of the other side's states
on the previous z is neglected. With nothing shared it is an ordinary filter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.types import Array, Gaussian, freeze, frozen

CLIP = 3.0  # [sd] beyond which a residual counts as that large


@dataclass(frozen=True, eq=False)
class ConditionalBelief:
    """Belief in s given z, without its mean (the point), which the caller keeps."""

    L: Array  # (p, z)
    cov: Array  # (p, p) given z
    about: Array  # (z,) mean of z when s was last updated
    spread: Array  # (z, z) covariance of z then

    def __post_init__(self) -> None:
        freeze(self, "L", "cov", "about", "spread")

    @property
    def whole(self) -> Array:
        """Marginal covariance of s, (p, p)."""
        return np.asarray(self.cov + self.L @ self.spread @ self.L.T)

    def after_drift(self, Q: Array) -> ConditionalBelief:
        """The belief after z has strayed by N(0, Q), (z, z)."""
        if not Q.any():
            return self
        spread = self.spread + Q
        L = np.asarray(np.linalg.solve(spread, self.spread @ self.L.T).T)
        cov = self.cov + self.L @ self.spread @ self.L.T - L @ spread @ L.T
        return ConditionalBelief(L, frozen(0.5 * (cov + cov.T)), self.about, frozen(spread))

    def settled(self, z: Gaussian) -> tuple[Array, ConditionalBelief]:
        """The step of s, (p,), due to the belief in z now, and the belief about the new point."""
        step = self.L @ (z.mean - self.about)
        return step, replace(self, about=z.mean, spread=z.cov)


def nothing_besides(z: Gaussian) -> ConditionalBelief:
    """A belief without states of its own: all states of an ordinary filter are shared."""
    n = len(z.mean)
    return ConditionalBelief(np.zeros((0, n)), np.zeros((0, 0)), z.mean, z.cov)


@dataclass(frozen=True, eq=False)
class LinearisedObservation:
    """One observation, linearised about the means of s and z."""

    e: Array  # (m,) measured less expected
    Hs: Array  # (m, p)
    Hz: Array  # (m, z)
    R: Array  # (m, m)

    def regressor(self, conditional: ConditionalBelief) -> Array:
        """A, of e on z, (m, z)."""
        return np.asarray(self.Hs @ conditional.L + self.Hz)

    def expected(self, conditional: ConditionalBelief) -> Array:
        """Covariance of e, (m, m)."""
        A, N = _seen(conditional, self)
        return np.asarray(A @ conditional.spread @ A.T + N)

    def surprise(self, conditional: ConditionalBelief) -> float:
        """Normalised square of e, divided by its number of rows: 1 is expected."""
        return float(self.e @ np.linalg.solve(self.expected(conditional), self.e)) / len(self.e)


def updated(
    conditional: ConditionalBelief, observation: LinearisedObservation
) -> tuple[Array, ConditionalBelief]:
    """The step of the point, (p,), and the belief about it after the observation."""
    A, N = _seen(conditional, observation)
    K = np.linalg.solve(N, observation.Hs @ conditional.cov).T
    cov = conditional.cov - K @ observation.Hs @ conditional.cov
    return K @ observation.e, replace(conditional, L=conditional.L - K @ A, cov=0.5 * (cov + cov.T))


@dataclass(frozen=True, eq=False)
class SharedMeasurement:
    """An observation as the filter that has z among its states sees it: y = H z + noise R."""

    y: Array  # (m,)
    H: Array  # (m, z)
    R: Array  # (m, m)
    jump: Array  # (z,) sd of a jump of z just before


def measurement(
    conditional: ConditionalBelief, observation: LinearisedObservation, jump: Array
) -> SharedMeasurement:
    """The observation with s marginalised out."""
    A, N = _seen(conditional, observation)
    return SharedMeasurement(observation.e + A @ conditional.about, A, N, jump)


def updated_noise(
    squares: Array, conditional: ConditionalBelief, observation: LinearisedObservation, gain: float
) -> Array:
    """Variances of noise, (k,), one per three rows, after one more observation: online EM.

    Each moves by `gain` toward the expected square of the noise, given the whole residual.
    """
    W, white = whitened(conditional, observation)
    own = np.repeat(squares, 3)[: len(white)]
    held = (own - own**2 * np.diag(W) + (own * white) ** 2).reshape(-1, 3).mean(axis=1)
    after = np.array(squares)
    after[: len(held)] += gain * (held - after[: len(held)])
    return after


def whitened(
    conditional: ConditionalBelief, observation: LinearisedObservation
) -> tuple[Array, Array]:
    """Precision W of a residual, (m, m), and W e, with e clipped at CLIP standard deviations."""
    W = np.asarray(np.linalg.inv(observation.expected(conditional)), dtype=np.float64)
    length = float(np.sqrt(observation.e @ W @ observation.e / len(observation.e)))
    return W, np.asarray(W @ observation.e * (CLIP / max(length, CLIP)))


def _seen(
    conditional: ConditionalBelief, observation: LinearisedObservation
) -> tuple[Array, Array]:
    """Regressor of e on z, (m, z), and covariance of e given z, (m, m)."""
    N = observation.Hs @ conditional.cov @ observation.Hs.T + observation.R
    return observation.regressor(conditional), 0.5 * (N + N.T)
