"""Inputs of one slice of a robot's operation: the motion, as the parameters' regressors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.types import Array, changed

DOUBT = 0.5  # [-] sd of the presliding state of a joint that stands
CREEP = 0.02  # [rad/s] scale over which that decays

ROWS = ("hold", "rest", "s", "v", "load", "a", "one")
COLUMN = {name: k - len(ROWS) for k, name in enumerate(ROWS)}  # in `packed`


@dataclass(frozen=True, eq=False)
class Carried:
    """The approximate payload, and the currents linearised about it."""

    payload: Array  # (10,)
    slope: Array  # (J, 10) [A] per unit of payload
    torque: Array  # (J,) [N·m] its torque
    held: Array  # (J,) [N·m] its part of the load of structural damping
    current: Array  # (J,) [A] slope @ payload


@dataclass(frozen=True, eq=False)
class RobotSlice:
    """Regressors of the parameters, joint by joint.

    The current is linear in `packed`, so that filtering currents in time amounts to filtering it:
    A (J, c), torque per unit of k, skew, m and payload; A_hold (J, c), the same for the load of
    structural damping; and ROWS, (J,) each.
    """

    dt: float  # [s] since the slice before
    span: float  # [s] since parameters last moved; 0: they do not move in this slice
    packed: Array  # (J, 2 c + 7)
    side: Array  # (J,) [-] presliding state times the sign of each gear's load
    gripped: Array  # (J,) [A²] variance due to the uncertain presliding state
    smeared: Array  # (J,) [A²] variance due to differentiation of the acceleration
    noise: Array  # (J,) [A] sd
    warm: Array  # (J,) [K] lubricant above the first day's temperature, by the model; 0: unknown
    felt: Array  # (J,) [-] 1 where the joint's temperature is measured, else 0
    blind: bool = True  # some joint's temperature is not measured
    share: Array | None = None  # (2, J) [-] factor on `doubted`; None: 1
    stray: Array | None = None  # (J,) [A] sd of slow noise; None: there is none
    jolted: Array | None = None  # (J,) [-] 1 where a joint's drive changed abruptly; None: nowhere
    wears: bool = False  # the change goes on
    taken: Array | None = None  # (10,) sd of what may have been added to the payload; None: nothing
    widen: bool = False  # the payload may be another from here on
    carried: Carried | None = None  # None: the payload's effect is exact

    def filtered(
        self, packed: Array, noise: Array, stray: Array, share: Array | None = None
    ) -> RobotSlice:
        """The slice after filtering in time, which gave this `packed`, noise and slow noise.

        The motion's errors change slowly, and pass the filter as `one` does. `share` is a factor on
        `doubted`, (2, J); None: 1.
        """
        passes = packed[:, COLUMN["one"]] ** 2
        return changed(
            self,
            packed=packed,
            gripped=passes * self.gripped,
            smeared=passes * self.smeared,
            noise=noise,
            stray=stray,
            share=share,
        )

    @cached_property
    def doubted(self) -> Array:
        """Stated variance due to uncertain presliding, and to uncertain accelerations, (2, J) [A²].

        The latter excludes accelerations' usual errors, which are in the noise.
        """
        return np.array([self.gripped, np.maximum(self.smeared - self.power, 0.0)])

    @cached_property
    def unknown(self) -> Array:
        """Variance due to both, (J,) [A²]."""
        if self.share is None:
            return np.asarray(self.doubted.sum(axis=0))
        return np.asarray(np.vecdot(self.share.T, self.doubted.T))

    @cached_property
    def power(self) -> Array:
        """Variance of white noise, (J,) [A²]."""
        return np.asarray(self.noise**2)

    @cached_property
    def variance(self) -> Array:
        """Variance of white noise and of the motion's uncertainty, (J,) [A²]."""
        return np.asarray(self.power + self.unknown)

    @property
    def roughly(self) -> Array | None:
        """The approximate payload, (10,); None: unknown."""
        return None if self.carried is None else self.carried.payload

    @property
    def A(self) -> Array:
        """Torque per unit of k, skew, m, payload, (J, c)."""
        return self.packed[:, : self._width]

    @property
    def A_hold(self) -> Array:
        """The same of `hold`, (J, c)."""
        return self.packed[:, self._width : 2 * self._width]

    @property
    def load(self) -> Array:
        """Rigid-body torque of the reference, (J,) [N·m]."""
        return self.packed[:, COLUMN["load"]]

    @property
    def hold(self) -> Array:
        """|load| s of the reference, (J,) [N·m]."""
        return self.packed[:, COLUMN["hold"]]

    @property
    def rest(self) -> Array:
        """Torque of ripple, warmth and friction that fades with speed, (J,) [N·m]."""
        return self.packed[:, COLUMN["rest"]]

    @property
    def s(self) -> Array:
        """Presliding state, (J,) [-]."""
        return self.packed[:, COLUMN["s"]]

    @property
    def v(self) -> Array:
        """Speed, (J,) [rad/s]."""
        return self.packed[:, COLUMN["v"]]

    @property
    def a(self) -> Array:
        """Acceleration, (J,) [rad/s²]."""
        return self.packed[:, COLUMN["a"]]

    @property
    def one(self) -> Array:
        """Regressor of constants, (J,) [-]."""
        return self.packed[:, COLUMN["one"]]

    @property
    def _width(self) -> int:
        return int(self.packed.shape[1] - len(ROWS)) // 2


def presliding_doubt(v: Array) -> Array:
    """Standard deviation of the presliding state of joints at speeds v, (..., J) [-].

    Its errors in joints that slide are in the noise already.
    """
    return np.asarray(DOUBT * np.exp(-np.abs(v) / CREEP))


def packed(
    A: Array,
    side: Array,
    load: Array,
    rest: Array,
    s: Array,
    v: Array,
    a: Array,
) -> Array:
    """What a slice is linear in; `side` (J,): s times the sign of each gear's load."""
    return laid_out(A, side, (side * load, rest, s, v, load, a, 1.0))


def laid_out(A: Array, held: Array, rows: tuple[Array | float, ...]) -> Array:
    """A (J, c), the same times `held` (J,), and ROWS, (J,) each: (J, 2 c + 7)."""
    J, c = A.shape
    out = np.empty((J, 2 * c + len(ROWS)))
    out[:, :c] = A
    np.multiply(held[:, None], A, out=out[:, c : 2 * c])
    for k, row in enumerate(rows, 2 * c):
        out[:, k] = row
    return out
