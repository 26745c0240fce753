"""The model with its true noise, for a bound that is independent of what a filter learnt.

Every band of the sensors' noise is a state of its own, or two where it oscillates,

    s' = keep (cos w, -sin w; sin w, cos w) s + sqrt(1 - keep²) sd w,    y = observe(x) + s + white

in place of the slow state with which a filter allows for them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.dbn.joined import Joined
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.simulate.noise import Band
from urdyn.simulate.sensors import Sensors
from urdyn.types import Array, Gaussian, Mask


@dataclass(frozen=True, eq=False)
class Coloured:
    """A `TwoSlice`: a robot's states, followed by its sensors' noise."""

    model: Joined[RobotSlice]
    slow: slice  # states of the model with which a filter allows for slow noise
    sensors: Sensors
    step: float  # [s] between rows

    @cached_property
    def _floor(self) -> Array:
        """White noise outside the bands, (J,) [A] sd."""
        left = 1.0 - sum((b.share for b in self.sensors.bands), 0.0 * self.sensors.current_noise)
        return np.asarray(self.sensors.current_noise * np.sqrt(np.maximum(left, 1e-4)))

    @cached_property
    def _noise(self) -> tuple[Array, Array, Array]:
        """F (b, b), variances (b,) and the current in which each state shows, (J, b)."""
        J, blocks = len(self._floor), [self._block(band) for band in self.sensors.bands]
        sizes = [len(F) for F, _ in blocks for _ in range(J)]
        F, variance = np.zeros((sum(sizes),) * 2), np.zeros(sum(sizes))
        seen, first = np.zeros((J, sum(sizes))), 0
        for block, power in blocks:
            for j in range(J):
                rows = slice(first, first + len(block))
                F[rows, rows], variance[rows], seen[j, first] = block, power[j], 1.0
                first = rows.stop
        return F, variance, seen

    def _block(self, band: Band) -> tuple[Array, Array]:
        """One joint's F, and the variances of all joints, (J,)."""
        keep, turn = np.exp(-self.step / band.time), 2.0 * np.pi * band.frequency * self.step
        power = self.sensors.current_noise**2 * band.share
        if not band.frequency:
            return np.array([[keep]]), power
        c, s = np.cos(turn), np.sin(turn)
        return keep * np.array([[c, -s], [s, c]]), power

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the model's states, then of the noise's."""
        return (*self.model.names, *(f"noise_{k}" for k in range(len(self._noise[1]))))

    @cached_property
    def prior(self) -> Gaussian:
        """The model's prior, and stationary noise."""
        n, variance = len(self.model.names), self._noise[1]
        cov = np.zeros((n + len(variance),) * 2)
        cov[:n, :n] = self.model.prior.cov
        cov[range(n, len(cov)), range(n, len(cov))] = variance
        return Gaussian(np.r_[self.model.prior.mean, 0.0 * variance], cov)

    @cached_property
    def linear(self) -> Mask:
        """The model's; noise is linear."""
        return np.concatenate([self.model.linear, np.ones(len(self._noise[1]), dtype=bool)])

    @property
    def affine_transition(self) -> bool:
        """As the model's."""
        return self.model.affine_transition

    @property
    def still(self) -> bool:
        """False: noise always moves."""
        return False

    def _parts(self, x: Array) -> tuple[Array, Array]:
        n = len(self.model.names)
        return x[..., :n], x[..., n:]

    def transition(self, x: Array, u: RobotSlice) -> Array:
        """Of both, (..., n + b)."""
        x, noise = self._parts(x)
        moved = self.model.transition(x, u)
        return np.concatenate([moved, noise @ self._noise[0].T], axis=-1)

    def transition_jacobian(self, x: Array, u: RobotSlice) -> Array:
        """(n + b, n + b)."""
        n = len(self.model.names)
        F = np.zeros((len(self.names),) * 2)
        F[:n, :n] = self.model.transition_jacobian(self._parts(x)[0], u)
        F[n:, n:] = self._noise[0]
        return F

    def transition_cov(self, u: RobotSlice) -> Array:
        """Process noise of a slice; that of the bands is for one step, whatever u.dt."""
        n, (F, variance, _) = len(self.model.names), self._noise
        Q = np.zeros((len(self.names),) * 2)
        Q[:n, :n] = self.model.transition_cov(u)
        Q[n:, n:] = np.diag(variance) - F * variance @ F.T
        return Q

    def observe(self, x: Array, u: RobotSlice) -> Array:
        """Currents with their noise, (..., J) [A]."""
        x, noise = self._parts(x)
        return np.asarray(self.model.observe(x, u) + noise @ self._noise[2].T)

    def observe_jacobian(self, x: Array, u: RobotSlice) -> Array:
        """(..., J, n + b)."""
        H = self.model.observe_jacobian(self._parts(x)[0], u)
        H[..., self.slow] = 0.0
        seen = np.broadcast_to(self._noise[2], (*H.shape[:-1], self._noise[2].shape[1]))
        return np.concatenate([H, seen], axis=-1)

    def observe_cov(self, u: RobotSlice) -> Array:
        """Covariance of the white noise, (J, J)."""
        return self.model.observe_cov(replace(u, noise=self._floor))
