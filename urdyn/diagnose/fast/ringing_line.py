"""The ringing lines in a window of joints' currents, if any.

A line must exceed its neighbours and this joint's usual spectrum, in both halves of the window at
the same frequency, and keep its size and phase. A gear's lines do not count (see `orders`), nor
does one of several: what happens to a joint in each period of a motion has lines at its multiples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.fast.lasting_line import CROWD, lasts, others, peaks
from urdyn.diagnose.fast.orders import GEAR, SLOW, beside
from urdyn.diagnose.fast.swings import (
    amplitude,
    course,
    floor,
    lines,
    neighbourhood,
    parts,
    refined,
    spectrum,
)
from urdyn.diagnose.kinds.fast_rules import RingingRule
from urdyn.diagnose.residual.space import Space
from urdyn.model.friction import GEAR_RATIO
from urdyn.types import Array, Mask

LEFT, TORQUE, SPEED = range(3)  # signals: torque residual, measured torque, speed
TORQUES = slice(LEFT, SPEED)
WINDOWS = {0.9: 0.125, 3.6: 0.25, 14.4: 1.0}  # [s], and time between looks [s]
EARLY = 0.9  # [-] of that time, after which the next look is due: stamps are uneven
HIGHEST = 60.0  # [Hz] no loop of a joint rings faster
LEARNT = 0.18  # [-] share in the usual spectrum per window's time; the first looks count evenly
LOUD = 4.0  # [-] times the usual: louder may be a fault, and is clipped here and learnt slowly
HALVES = 5.0  # [-] times its neighbours that the line must reach in each half
MOVES = 0.1  # [-] share of a ringing drive's line torque that its own motion takes
SEEN = 0.2  # [-] of its amplitude that noise may explain in a quarter
APART = 0.5  # [-] of its amplitude that must remain without what follows a motor's angle
ODD = 3, 5  # multiples of a swing that friction's reversal makes
ROOT = 0.15  # [-] of a bin by which such a swing may differ from line / order
BAND = 0.06  # [-] about the gear's lines that is excluded
NEAR = 1.0  # [Hz] by which the same line may differ: a gear's line moves with its speed
STEADY = 0.2  # [-] of its speed by which a joint that makes a line may vary


@dataclass(frozen=True, eq=False)
class Line:
    """A line that lasts."""

    joint: int
    frequency: float  # [Hz]
    ratio: float  # [-] of its power to the usual
    sizes: Array  # (4,) [N·m] its amplitude by quarter


@dataclass(frozen=True, eq=False)
class Usual:
    """A window's usual spectrum."""

    power: Array  # (3, F, J); empty before the first
    looks: float = 0.0  # number of looks learnt from
    due: float = -np.inf  # [s] when the next look is


@dataclass(frozen=True, eq=False)
class Stretch:
    """A window's rows, and the frequencies of their spectrum."""

    t: Array  # (n,) [s]
    signals: Array  # (3, n, J)
    f: Array  # (F,) [Hz]

    def nearest(self, frequency: float) -> int:
        """The bin nearest to a frequency [Hz]."""
        return round(frequency / float(self.f[1]))


@dataclass(frozen=True, eq=False)
class LineSearch:
    """Searches a window of signals, (3, n, J), for the lines of loops that ring."""

    space: Space
    period: float  # [s] between rows
    rule: RingingRule

    def look(
        self, before: Usual, window: float, t: Array, signals: Array
    ) -> tuple[Usual, list[Line]]:
        """The usual spectrum updated with this window, and the lines that last in it."""
        seen = Stretch(t, signals, self._frequencies(t))
        whole = spectrum(signals, len(seen.f))
        usual = before.power if before.looks else whole
        beside = neighbourhood(whole)
        least = floor(beside, usual)
        ratio = whole / np.where(least > 0.0, least, np.inf)
        apart = (whole[TORQUES] / np.maximum(beside[TORQUES], 1e-30)).max(axis=0)
        found = self._lines(seen, ratio, apart)
        ringing = np.isin(np.arange(self.space.joints), [line.joint for line in found])
        after = _learnt(before, whole, ringing, window, float(t[-1]))
        out = ratio[TORQUES].max(axis=0)
        loudest = [self._loudest(same, found, seen, out) for same in _together(found)]
        return after, [self._root(line, seen, ratio[SPEED]) for line in loudest]

    def _frequencies(self, t: Array) -> Array:
        """Frequencies of a window's spectrum, (F,) [Hz]: a fixed number, by the rows' own step.

        A recorder's steps of 10 and 12 ms are 10.7 in the mean, which is a bin in sixteen.
        """
        nominal = np.fft.rfftfreq(len(t), self.period)
        step = (t[-1] - t[0]) / (len(t) - 1)
        return np.asarray(nominal[nominal <= HIGHEST] * self.period / step, dtype=np.float64)

    def _lines(self, seen: Stretch, ratio: Array, apart: Array) -> list[Line]:
        """The line of each joint that has one, alone.

        Args:
            ratio: of the spectrum to the usual, (3, F, J).
            apart: of torques to their neighbours, (F, J).
        """
        signals, f = seen.signals, seen.f
        allowed = self._allowed(f, signals[SPEED])
        ratio, apart = np.where(allowed, ratio, 0.0), np.where(allowed, apart, 0.0)
        loud = (ratio >= self.rule.threshold).any(axis=(0, 1))
        joints = np.flatnonzero(loud & np.isfinite(signals).all(axis=(0, 1))).tolist()
        if not joints:  # as nearly always
            return []
        halves = [lines(signals[:, part], len(f) // 2 + 1) for part in parts(len(seen.t), 2)]
        found = []
        for j in joints:
            own = [half[..., j] for half in halves]
            line = self._line(j, seen, ratio[..., j], own)
            if line and others(apart[:, j], line.frequency / f[1]) < CROWD[0]:
                found.append(line)
        return found

    def _line(self, j: int, seen: Stretch, ratio: Array, halves: Sequence[Array]) -> Line | None:
        """The line of joint j that lasts; None where none does.

        Args:
            ratio: of its signals' spectra to the usual, (3, F); 0 where no line may be.
            halves: how far lines stand out in each half, (3, F') both.
        """
        least = (self.rule.least, self.rule.least, self.rule.swing)
        t, f, x = seen.t, seen.f, seen.signals[..., j]
        for k in range(len(x)):
            for at in peaks(ratio[k], self.rule.threshold):
                near = slice(max(at // 2 - 1, 0), at // 2 + 3)
                if any(half[k, near].max() < HALVES for half in halves):
                    continue
                frequency = refined(x[k], t, f[at], f[1])
                if frequency > f[-2]:  # of a line outside, or too near its own image there
                    continue
                sizes = course(x[k], t, frequency)
                whole = amplitude(x[k], t, frequency)
                noise = 0.0 if k == SPEED else self.scatter(j, whole, len(t))
                if not lasts(sizes, whole, noise) or sizes[-2:].mean() <= least[k]:
                    continue
                if beside(x[k], t, frequency, seen.signals[SPEED], j) > APART * whole:
                    torque = course(x[TORQUE], t, frequency) if k == SPEED else sizes
                    return Line(j, frequency, float(ratio[k, at]), torque)
        return None

    def scatter(self, joint: int, size: float, rows: int) -> float:
        """sd that a sensor's noise may give an amplitude of this size in a quarter of a window.

        Args:
            size: [N·m] of the line.
            rows: of the window.
        """
        row = float(self.space.reference.drive.gain[joint] * self.space.noise[joint])
        return min(row * float(np.sqrt(2.0 / (0.25 * rows))), SEEN * size)

    def _loudest(
        self, same: Sequence[Line], found: Sequence[Line], seen: Stretch, ratio: Array
    ) -> Line:
        """The line of joints that ring together: that of the drive with most torque.

        Among those in which it stands out, whether or not it passes all other tests there, and
        which have no other line of their own; by the torque that moves the drive itself, where
        there is any: another, which holds its joint still, may need more.

        Args:
            same: this line in each joint, the clearest first.
            found: all lines.
            ratio: of torques to the usual, (F, J).
        """
        clearest, t, f = same[0], seen.t, seen.f
        frequency, torque = clearest.frequency, seen.signals[TORQUE]
        at = seen.nearest(frequency)
        out = ratio[at - 1 : at + 2].max(axis=0) > HALVES
        out[[line.joint for line in found]] = False
        out[[line.joint for line in same]] = True
        drives = np.flatnonzero(out & np.isfinite(seen.signals[TORQUE:]).all(axis=(0, 1)))
        drive, w = self.space.reference.drive, 2.0 * np.pi * frequency
        does, goes = (
            np.array([amplitude(x[:, j], t, frequency) for j in drives])
            for x in (torque, seen.signals[SPEED])
        )
        moved = np.minimum(does, w * drive.rotor_inertia[drives] * goes)
        whole, own = does / drive.coulomb[drives], moved / drive.coulomb[drives]
        loudest = int(drives[np.argmax(own if own.max() > MOVES * whole.max() else whole)])
        if loudest == clearest.joint:
            return clearest
        # Joints that it shakes may ring at slightly another frequency.
        frequency = refined(torque[:, loudest], t, f[at], f[1])
        sizes = course(torque[:, loudest], t, frequency)
        return Line(loudest, frequency, clearest.ratio, sizes)

    def _root(self, line: Line, seen: Stretch, ratio: Array) -> Line:
        """The slow swing of which this line is an odd multiple, if it is one; or this line.

        Friction reverses with its joint, and so makes odd multiples of a swing too slow to be a
        line itself: the joint then swings at that frequency, and faster than at the multiple. A
        program moves it at such frequencies too, but does so before the line is there.

        Args:
            ratio: of speeds to the usual, (F, J).
        """
        t, own = seen.t, seen.signals[..., line.joint]
        v, torque = own[SPEED], own[TORQUE]
        width, speed = 1.0 / float(t[-1] - t[0]), amplitude(v, t, line.frequency)
        for order in ODD:
            frequency = refined(v, t, line.frequency / order, ROOT * width)
            if not 2.0 * width < frequency < self.rule.lowest + width:
                continue
            at = seen.nearest(frequency)
            if ratio[at - 1 : at + 2, line.joint].max() < HALVES:
                continue
            whole, sizes = amplitude(v, t, frequency), course(torque, t, frequency)
            if whole > order * speed and lasts(course(v, t, frequency), whole, 0.0):
                return replace(line, frequency=frequency, sizes=sizes)
        return line

    def _allowed(self, f: Array, v: Array) -> Mask:
        """Frequencies that neither the motion nor the gear makes, (F, J)."""
        nyquist, lowest = 0.5 * len(v) * f[1], self.rule.lowest + f[1]  # a taper smears by a bin
        allowed = np.repeat((f >= lowest)[:, None], v.shape[1], axis=1)
        lo, hi = np.abs(v).min(axis=0), np.abs(v).max(axis=0)
        for order in GEAR:
            a, b = (order * GEAR_RATIO / (2.0 * np.pi) * x for x in (lo, hi))
            # a gear's line above half the rate is aliased
            for low, high in ((a, b), (2.0 * nyquist - b, 2.0 * nyquist - a)):
                steady = hi - lo < STEADY * hi
                near = (f[:, None] > (1.0 - BAND) * low) & (f[:, None] < (1.0 + BAND) * high)
                allowed &= ~(near & steady & (hi > SLOW))
        return allowed


def _together(seen: Sequence[Line]) -> list[list[Line]]:
    """Lines of one frequency, made by one loop, which shakes other joints too; clearest first."""
    together = list[list[Line]]()
    for line in sorted(seen, key=lambda line: line.ratio, reverse=True):
        for same in together:
            if abs(line.frequency - same[0].frequency) < NEAR:
                same.append(line)
                break
        else:
            together.append([line])
    return together


def _learnt(before: Usual, whole: Array, ringing: Mask, window: float, t: float) -> Usual:
    """The usual spectrum after another (3, F, J) at t [s]; that of ringing joints is kept."""
    usual, looks = before.power if before.looks else whole, before.looks + 1.0
    slow = LEARNT * WINDOWS[window] / window
    gain = np.where(whole > LOUD * usual, slow, max(slow, 1.0 / looks))
    learnt = usual + gain * (np.minimum(whole, LOUD * usual) - usual)
    return Usual(np.where(ringing, usual, learnt), looks, t + EARLY * WINDOWS[window])
