"""How a robot's parameters move: own parts that stray, the network's edges, fading states.

Own parts of the network's nodes (see `graph`) stray: f strays, alpha follows f by the coefficient
of f -> alpha and strays besides, and a shared disturbance makes f and z stray together. f and z
wear, so they have rates. Fading states return to zero.

    f' = f + h rate_f + w_f,    cov(w_f, w_z) = rho q_f q_z
    alpha' = alpha + b (f' - f) + w_alpha
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn.robot_slice import RobotSlice
from urdyn.types import Array, Gaussian, Index, Mask, freeze


@dataclass(frozen=True)
class Fading:
    """Parameters that stray around zero and return to it."""

    at: slice
    memory: float  # [s]
    sd: float  # stationary


@dataclass(frozen=True)
class Jolt:
    """Parameters, one per joint, that an abrupt change of its drive may change."""

    at: slice
    sd: float  # of that change
    rate: float = 0.0  # [1/s] sd of the rate at which it may go on, where it has one


@dataclass(frozen=True, eq=False)
class Wear:
    """Process of a robot's p parameters, followed by the rates of r of them."""

    parameters: tuple[str, ...]  # p
    prior: Gaussian  # (p + r,)
    own: Array  # (p, p) [1/s] diffusion covariance of own parts
    drifting: Index  # (r,) parameters that have a rate
    push: Array  # (r, r) [1/s³] the same for the rates
    lead: Array  # (p, p) B, coefficients within a slice: child by parent
    warmth: Array  # (p,) [1/√s] in addition to `own`, where a joint's temperature is not measured
    fading: tuple[Fading, ...]
    jolts: tuple[Jolt, ...]
    payload: slice
    slow: slice
    beside: slice  # other streams' own states, which are reset now and then
    memory: float  # [s] of slow noise

    def __post_init__(self) -> None:
        freeze(self, "own", "push", "lead", "warmth")

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The parameters, then one rate for each that drifts."""
        return (*self.parameters, *(f"{self.parameters[i]}.rate" for i in self.drifting))

    @cached_property
    def linear(self) -> Mask:
        """All states, (p + r,)."""
        return np.ones(len(self.names), dtype=bool)

    @cached_property
    def _spread(self) -> Array:
        """M = (1 - B)^-1: effect of a change of each own part on every parameter, (p, p)."""
        return np.asarray(np.linalg.inv(np.eye(len(self.parameters)) - self.lead))

    @cached_property
    def _follow(self) -> tuple[Index, Array]:
        """Parameters moved by rates, (c,), and D, their change per unit of each rate, (c, r)."""
        moved = self._spread[:, self.drifting]
        child = np.flatnonzero(moved.any(axis=1))
        return child, moved[child]

    @cached_property
    def _noise(self) -> tuple[Index, Array]:
        """Q's nonzero entries, (e,), and their factors of dt, dt² / 2, dt³ / 3, (3, e)."""
        p, n = len(self.parameters), len(self.names)
        M, moved = self._spread, self._spread[:, self.drifting]
        parts = np.zeros((3, n, n))
        parts[0, :p, :p] = M @ self.own @ M.T
        parts[0, p:, p:] = self.push
        parts[1, :p, p:] = moved @ self.push
        parts[1, p:, :p] = parts[1, :p, p:].T
        parts[2, :p, :p] = moved @ self.push @ moved.T
        at = np.flatnonzero(parts.any(axis=0))
        return at, parts.reshape(3, -1)[:, at]

    @cached_property
    def _rates(self) -> list[Index]:
        """For each jolt, the states that are its parameters' rates; empty where they have none."""
        p = len(self.parameters)
        return [
            p + np.flatnonzero((jolt.at.start <= self.drifting) & (self.drifting < jolt.at.stop))
            for jolt in self.jolts
        ]

    @cached_property
    def _forgetting(self) -> Array:
        """Rate at which each state decays to zero, (n,) [1/s]; zero where it stays."""
        rates = np.zeros(len(self.names))
        for fading in self.fading:
            rates[fading.at] = 1.0 / fading.memory
        rates[self.slow] = 1.0 / self.memory
        return rates

    @cached_property
    def _faded(self) -> Array:
        """Stationary variance of `fading` states, (n,); 0 of others."""
        variance = np.zeros(len(self.names))
        for fading in self.fading:
            variance[fading.at] = fading.sd**2
        return variance

    def transition(self, x: Array, u: RobotSlice) -> Array:
        """Move every parameter by the rates that lead it, (..., p + r)."""
        return self._led(x, u.span)

    def later(
        self, belief: Gaussian, span: float, blind: bool, besides: Array | float = 0.0
    ) -> Gaussian:
        """The belief `span` [s] later, without measurements.

        Args:
            blind: some joint's temperature is not measured.
            besides: variance to add, (n,), of abrupt changes say.
        """
        cov = self._strayed(self._propagated(belief.cov, span), span, blind, besides)
        return Gaussian(self._led(belief.mean, span), cov)

    def predicted(self, belief: Gaussian, u: RobotSlice) -> Gaussian:
        """The belief predicted over a slice."""
        return self.later(belief, u.span, u.blind, self._besides(u))

    def befallen(self, belief: Gaussian, drives: Array, wears: bool) -> Gaussian:
        """The belief once drives may have changed abruptly, (J,) 1 where they may have.

        Args:
            wears: whether the change may go on.
        """
        cov = np.array(belief.cov)
        cov.flat[:: len(cov) + 1] += self._jolted(drives, wears)
        return Gaussian(belief.mean, cov)

    def _jolted(self, drives: Array, wears: bool) -> Array:
        """Variance of such changes, (n,)."""
        variance = np.zeros(len(self.names))
        for jolt, rates in zip(self.jolts, self._rates, strict=True):
            variance[jolt.at] += jolt.sd**2 * drives
            if wears and len(rates):
                variance[rates] += jolt.rate**2 * drives
        return variance

    def _led(self, x: Array, span: float) -> Array:
        """x after `span` [s], moved by the rates that lead it, (..., p + r)."""
        (child, D), p = self._follow, len(self.parameters)
        kept = np.exp(-span * self._forgetting)
        moved = x * kept
        moved[..., child] += span * kept[child] * (x[..., p:] @ D.T)
        return moved

    def _propagated(self, P: Array, span: float) -> Array:
        """F P Fᵀ, (n, n): in n², not n³, as few states depend on others."""
        (child, D), p = self._follow, len(self.parameters)
        kept = np.exp(-span * self._forgetting)
        moved = np.outer(kept, kept)
        moved *= P
        L = span * kept[child][:, None] * D
        led = moved[child] + L @ moved[p:]  # rates stay
        led[:, child] += led[:, p:] @ L.T
        led[:, child] = 0.5 * (led[:, child] + led[:, child].T)
        moved[child], moved[:, child] = led, led.T
        return moved

    def transition_jacobian(self, x: Array, u: RobotSlice) -> Array:
        """(n, n)."""
        (child, D), p = self._follow, len(self.parameters)
        kept = np.exp(-u.span * self._forgetting)
        F = np.diag(kept)
        F[child, p:] = u.span * kept[child][:, None] * D
        return F

    def transition_cov(self, u: RobotSlice) -> Array:
        """Noise of own parts and rates, spread along the edges and integrated over the slice."""
        n = len(self.names)
        return self._strayed(np.zeros((n, n)), u.span, u.blind, self._besides(u))

    def _besides(self, u: RobotSlice) -> Array:
        """Variance due to abrupt changes, and to slow noise, (n,)."""
        variance = np.zeros(len(self.names))
        if u.taken is not None:
            variance[self.payload] += u.taken**2
        if u.jolted is not None:
            variance += self._jolted(u.jolted, u.wears)
        if u.stray is not None:
            variance[self.slow] = u.stray**2 * -np.expm1(-2.0 * u.span / self.memory)
        return variance

    def _strayed(self, cov: Array, dt: float, blind: bool, besides: Array | float) -> Array:
        """`cov`, (n, n), modified in place by the noise of straying and fading states over dt [s].

        Args:
            besides: variance to add, (n,).
        """
        entries, (at, parts) = cov.reshape(-1), self._noise
        entries[at] += dt * (parts[0] + dt * (parts[1] / 2.0 + dt * parts[2] / 3.0))
        diagonal = besides - self._faded * np.expm1(-2.0 * dt * self._forgetting)
        if blind:
            diagonal[: len(self.parameters)] += self.warmth**2 * dt
        entries[:: len(cov) + 1] += diagonal
        return cov
