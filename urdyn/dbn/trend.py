"""The process that follows a ramp: each parameter with its rate of change."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn.two_slice import Slice
from urdyn.given import given_belief, given_each, given_names, given_places, given_sd, positive
from urdyn.types import Array, Gaussian, Index, Mask

_NODE, _WEIGHT = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True, eq=False)
class Trend:
    """Parameter and rate: the local linear trend, without lag and without bias on a ramp.

    theta' = theta + h rate + w,  rate' = exp(-dt / tau) rate + v,  h = tau (1 - exp(-dt / tau));
    with tau infinite the rate is a random walk. Only the parameters in `drifting` have a rate.
    """

    parameters: tuple[str, ...]  # p
    parameter_prior: Gaussian  # (p,), (p, p)
    diffusion: Array  # (p,) [unit/√s] of the parameters, besides their rates
    drifting: Index  # (r,) which parameters have a rate
    rate_sd: Array  # (r,) [unit/s] prior around zero
    acceleration: Array  # (r,) [unit/s/√s] diffusion of the rates
    time_constant: float = np.inf  # [s] tau, in which a rate decays

    def __post_init__(self) -> None:
        p = len(self.parameters)
        drifting = given_places(self.drifting, "drifting", p)
        object.__setattr__(self, "drifting", drifting)
        given_names(self.names)
        due = {"diffusion": (p,), "rate_sd": drifting.shape, "acceleration": drifting.shape}
        for name, shape in due.items():
            object.__setattr__(self, name, given_sd(getattr(self, name), name, shape))
        given_each(self.time_constant, "time_constant", (), "a time above 0 s", positive)
        prior = given_belief(self.parameter_prior, "the parameters' prior", p)
        object.__setattr__(self, "parameter_prior", prior)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The parameters, then one rate for each that drifts."""
        return (*self.parameters, *(f"{self.parameters[i]}.rate" for i in self.drifting))

    @cached_property
    def prior(self) -> Gaussian:
        """Rates around zero, independent of the parameters, (p + r,)."""
        p = len(self.parameters)
        cov = np.diag(np.r_[np.zeros(p), self.rate_sd**2])
        cov[:p, :p] = self.parameter_prior.cov
        return Gaussian(np.r_[self.parameter_prior.mean, np.zeros(len(self.rate_sd))], cov)

    @cached_property
    def linear(self) -> Mask:
        """All states, (p + r,)."""
        return np.ones(len(self.names), dtype=bool)

    def _reach(self, u: Slice) -> tuple[float, float]:
        """h [s] and exp(-dt / tau)."""
        if np.isinf(self.time_constant):
            return u.dt, 1.0
        lost = -np.expm1(-u.dt / self.time_constant)
        return float(self.time_constant * lost), float(1.0 - lost)

    def transition(self, x: Array, u: Slice) -> Array:
        """Every parameter moves by its rate, (..., p + r)."""
        h, kept = self._reach(u)
        p, moved = len(self.parameters), x.copy()
        moved[..., self.drifting] += h * x[..., p:]
        moved[..., p:] *= kept
        return moved

    def transition_jacobian(self, x: Array, u: Slice) -> Array:
        """Identity, h from rate to parameter, exp(-dt / tau) from rate to rate."""
        h, kept = self._reach(u)
        p, n = len(self.parameters), len(self.names)
        F = np.eye(n)
        F[self.drifting, range(p, n)] = h
        F[range(p, n), range(p, n)] = kept
        return F

    def transition_cov(self, u: Slice) -> Array:
        """Noise of rates, and of parameters through them, integrated over the slice."""
        rates = range(len(self.parameters), len(self.names))
        level, both, slope = self._gathered(u.dt)
        Q = np.diag(np.r_[self.diffusion**2 * u.dt, self.acceleration**2 * slope])
        Q[self.drifting, self.drifting] += self.acceleration**2 * level
        Q[self.drifting, rates] = Q[rates, self.drifting] = self.acceleration**2 * both
        return Q

    def _gathered(self, dt: float) -> tuple[float, float, float]:
        """Integrals over the slice of h(s)², h(s) k(s), k(s)², with k = exp(-s / tau)."""
        tau = self.time_constant
        if np.isinf(tau):
            return dt**3 / 3.0, dt**2 / 2.0, dt
        lost = -float(np.expm1(-dt / tau))
        both, slope = 0.5 * (tau * lost) ** 2, -0.5 * tau * float(np.expm1(-2.0 * dt / tau))
        if dt > tau:
            return tau**2 * (dt - tau * lost * (1.0 + 0.5 * lost)), both, slope
        # By Gauss-Legendre: the closed form is a difference of nearly equal terms where dt << tau.
        h = tau * np.expm1(-0.5 * dt / tau * (1.0 + _NODE))
        return float(0.5 * dt * _WEIGHT @ h**2), both, slope
