"""Inputs of one slice of a robot's life: what the motion makes of the parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.types import Array, changed

DOUBT = 0.5  # [-] sd of the presliding state of a joint that stands
CREEP = 0.02  # [rad/s] over which that fades

ROWS = ("hold", "rest", "s", "v", "load", "a", "one")
COLUMN = {name: k - len(ROWS) for k, name in enumerate(ROWS)}  # of what is packed


@dataclass(frozen=True, eq=False)
class Carried:
    """What is carried, roughly, and how the currents grow with it there."""

    payload: Array  # (10,)
    slope: Array  # (J, 10) [A] per unit of payload
    torque: Array  # (J,) [N·m] what it does
    held: Array  # (J,) [N·m] and what of that structural damping rides on
    current: Array  # (J,) [A] slope @ payload


@dataclass(frozen=True, eq=False)
class RobotSlice:
    """What multiplies each parameter, joint by joint.

    The current is linear in `packed`, so that a filter in time of currents is the same filter of
    it: of A (J, c), torque per unit of k, skew, m and payload, of A_hold (J, c), the same of what
    structural damping rides on, and of ROWS, (J,) each.
    """

    dt: float  # [s] since the slice before
    span: float  # [s] since parameters moved last; 0: they stand still over this slice
    packed: Array  # (J, 2 c + 7)
    side: Array  # (J,) [-] presliding state, as each gear is loaded along it or against it
    gripped: Array  # (J,) [A²] variance, for nobody knows the presliding state
    smeared: Array  # (J,) [A²] the same, for the acceleration was differentiated
    noise: Array  # (J,) [A] sd
    warm: Array  # (J,) [K] of the lubricant over that of the first day, by the model; 0 unknown
    felt: Array  # (J,) [-] 1 where the joint's temperature is measured, else 0: nothing is claimed
    blind: bool = True  # nobody measures how warm some joint is
    share: Array | None = None  # (2, J) [-] of `doubted` that there is; None: all
    stray: Array | None = None  # (J,) [A] sd of slow noise; None: there is none
    jolted: Array | None = None  # (J,) [-] 1 where something befell a joint's drive; None: nowhere
    wears: bool = False  # what befell it goes on
    taken: Array | None = None  # (10,) sd of what may be carried besides; None: nothing
    widen: bool = False  # something else may be carried from here on
    carried: Carried | None = None  # None: what a payload does is exact

    def filtered(
        self, packed: Array, noise: Array, stray: Array, share: Array | None = None
    ) -> RobotSlice:
        """After a filter in time that has made `packed`, noise and slow noise of its own, of these.

        What nobody knows of a motion changes slowly, and comes through as `one` does. Of that as
        much as `share` is left, (2, J) of `doubted`; None: all.
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
        """Variance by doubt about presliding, and about accelerations, as stated, (2, J) [A²].

        What is smeared is so but for how far accelerations usually are off: noise has that.
        """
        return np.array([self.gripped, np.maximum(self.smeared - self.power, 0.0)])

    @cached_property
    def unknown(self) -> Array:
        """Variance by both, (J,) [A²]."""
        if self.share is None:
            return np.asarray(self.doubted.sum(axis=0))
        return np.asarray(np.vecdot(self.share.T, self.doubted.T))

    @cached_property
    def power(self) -> Array:
        """Variance of white noise, (J,) [A²]."""
        return np.asarray(self.noise**2)

    @cached_property
    def variance(self) -> Array:
        """Of white noise, and of what nobody knows of the motion, (J,) [A²]."""
        return np.asarray(self.power + self.unknown)

    @property
    def roughly(self) -> Array | None:
        """What is carried, as far as it was found out, (10,); None: nobody did."""
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
        """Of ripple, warmth and friction that fades with speed, (J,) [N·m]."""
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
        """What multiplies what does not move, (J,) [-]."""
        return self.packed[:, COLUMN["one"]]

    @property
    def _width(self) -> int:
        return int(self.packed.shape[1] - len(ROWS)) // 2


def presliding_doubt(v: Array) -> Array:
    """Standard deviation of the presliding state of joints at speeds v, (..., J) [-].

    How far it is off in joints that slide is in the noise already.
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
    """What a slice is linear in, of gears that are loaded along s or against it, `side` (J,)."""
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
