"""The lines that ring in a window of joints' currents, if there are such.

A line has to stand out of its neighbours and of what this joint's spectrum is like as a rule, in
both halves of the window at the same frequency, and keep its size and phase. Lines that a gear
makes do not count (see `orders`), nor one of several: what befalls a joint in every period of a
motion has lines at its multiples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.fast_rules import RingingRule
from urdyn.diagnose.lasting_line import CROWD, lasts, others, peaks
from urdyn.diagnose.orders import GEAR, SLOW, beside
from urdyn.diagnose.space import Space
from urdyn.diagnose.swings import (
    amplitude,
    course,
    floor,
    lines,
    neighbourhood,
    parts,
    refined,
    spectrum,
)
from urdyn.model.friction import GEAR_RATIO
from urdyn.types import Array, Mask

LEFT, TORQUE, SPEED = range(3)  # signals: what the model leaves, torque as measured, speed
TORQUES = slice(LEFT, SPEED)
WINDOWS = {0.9: 0.125, 3.6: 0.25, 14.4: 1.0}  # [s], and from one look to the next
EARLY = 0.9  # [-] of that time, from which on rows are the next look: stamps are not quite even
HIGHEST = 60.0  # [Hz] no loop of a joint rings faster
LEARNT = 0.18  # [-] share of the usual spectrum, over a window's time; of the first looks theirs
LOUD = 4.0  # [-] times what is usual: what is, may be the fault, and is learnt slowly as that much
HALVES = 5.0  # [-] times its neighbours that the line stands out in each half
MOVES = 0.1  # [-] of a line's torque, what its own motion takes of a drive that rings
SEEN = 0.2  # [-] of its amplitude that noise may be blamed for: less is not seen in a quarter
APART = 0.5  # [-] of its amplitude that is left beside what follows a motor's angle
ODD = 3, 5  # multiples of a swing that friction makes as it turns over
ROOT = 0.15  # [-] of a bin by which such a swing may be off its multiple's share
BAND = 0.06  # [-] about the gear's lines that does not count
NEAR = 1.0  # [Hz] that the same line may differ by: what a gear makes moves with its speed
STEADY = 0.2  # [-] of its speed by which a joint that makes a line may vary it


@dataclass(frozen=True, eq=False)
class Line:
    """A line that lasts."""

    joint: int
    frequency: float  # [Hz]
    ratio: float  # [-] of its power to what is usual
    sizes: Array  # (4,) [N·m] its amplitude by quarter


@dataclass(frozen=True, eq=False)
class Usual:
    """What a window's spectrum is like as a rule."""

    power: Array  # (3, F, J); of no size before one was heard
    looks: float = 0.0  # that it was learnt in
    due: float = -np.inf  # [s] when the next is


@dataclass(frozen=True, eq=False)
class LineSearch:
    """Searches a window of signals, (3, n, J), for the lines of loops that ring."""

    space: Space
    period: float  # [s] between rows
    rule: RingingRule

    def look(
        self, before: Usual, window: float, t: Array, signals: Array
    ) -> tuple[Usual, list[Line]]:
        """A window's spectrum as a rule with this one in it, and the lines that last in it."""
        f = self._frequencies(t)
        whole = spectrum(signals, len(f))
        usual = before.power if before.looks else whole
        beside = neighbourhood(whole)
        least = floor(beside, usual)
        ratio = whole / np.where(least > 0.0, least, np.inf)
        apart = (whole[TORQUES] / np.maximum(beside[TORQUES], 1e-30)).max(axis=0)
        seen = self._lines(t, signals, f, ratio=ratio, apart=apart)
        ringing = np.isin(np.arange(self.space.joints), [line.joint for line in seen])
        after = _learnt(before, whole, ringing, window, float(t[-1]))
        out = ratio[TORQUES].max(axis=0)
        each = _together(seen)
        lines = [self._loudest(same, seen, t, signals, f=f, ratio=out) for same in each]
        return after, [self._root(line, t, signals) for line in lines]

    def _frequencies(self, t: Array) -> Array:
        """Of a window's spectrum, (F,) [Hz]: as many in each, of rows as far apart as here.

        A recorder's steps of 10 and 12 ms are 10.7 in the mean, which is a bin in sixteen.
        """
        nominal = np.fft.rfftfreq(len(t), self.period)
        step = (t[-1] - t[0]) / (len(t) - 1)
        return np.asarray(nominal[nominal <= HIGHEST] * self.period / step, dtype=np.float64)

    def _lines(self, t: Array, signals: Array, f: Array, ratio: Array, apart: Array) -> list[Line]:
        """That of each joint in which there is one, alone.

        Args:
            f: frequencies, (F,) [Hz].
            ratio: of the spectrum to what is usual, (3, F, J).
            apart: of torques to their neighbours, (F, J).
        """
        allowed = self._allowed(f, signals[SPEED])
        apart = np.where(allowed, apart, 0.0)
        halves = [lines(signals[:, part], len(f) // 2 + 1) for part in parts(len(t), 2)]
        seen = []
        for j in np.flatnonzero(np.isfinite(signals).all(axis=(0, 1))).tolist():
            line = self._line(
                j,
                t,
                signals,
                f=f,
                ratio=ratio[..., j],
                allowed=allowed[:, j],
                halves=[half[..., j] for half in halves],
            )
            if line and others(apart[:, j], line.frequency / f[1]) < CROWD[0]:
                seen.append(line)
        return seen

    def _line(
        self,
        j: int,
        t: Array,
        signals: Array,
        f: Array,
        ratio: Array,
        allowed: Mask,
        halves: Sequence[Array],
    ) -> Line | None:
        """The line of joint j that lasts; None where none does.

        Args:
            ratio: of the spectra of its signals to what is usual, (3, F).
            halves: how far lines stand out in each half, (3, F') both.
        """
        least = (self.rule.least, self.rule.least, self.rule.swing)
        x = signals[..., j]
        for k in range(len(x)):
            masked = np.where(allowed, ratio[k], 0.0)
            for at in peaks(masked, self.rule.threshold):
                near = slice(max(at // 2 - 1, 0), at // 2 + 3)
                if any(half[k, near].max() < HALVES for half in halves):
                    continue
                frequency = refined(x[k], t, f[at], f[1])
                sizes = course(x[k], t, frequency)
                whole = amplitude(x[k], t, frequency)
                noise = 0.0 if k == SPEED else self.scatter(j, whole, len(t))
                if not lasts(sizes, whole, noise) or sizes[-2:].mean() <= least[k]:
                    continue
                if beside(x[k], t, frequency, signals[SPEED], j) > APART * whole:
                    torque = course(x[TORQUE], t, frequency) if k == SPEED else sizes
                    return Line(j, frequency, float(masked[at]), torque)
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
        self,
        same: Sequence[Line],
        seen: Sequence[Line],
        t: Array,
        signals: Array,
        f: Array,
        ratio: Array,
    ) -> Line:
        """The line of joints that ring together: that of the drive that does most.

        Of those in which it stands out, whether or not it passes all other tests there, and which
        have no other line of their own; and most to move itself, where one does: another, that
        holds its joint still, may have more to do.

        Args:
            same: what is seen of this line, the clearest first.
            seen: what is seen of all lines.
            ratio: of torques to what is usual, (F, J).
        """
        clearest = same[0]
        frequency, torque = clearest.frequency, signals[TORQUE]
        at = round(frequency / f[1])
        out = ratio[at - 1 : at + 2].max(axis=0) > HALVES
        out[[line.joint for line in seen]] = False
        out[[line.joint for line in same]] = True
        drives = np.flatnonzero(out & np.isfinite(signals[TORQUE:]).all(axis=(0, 1)))
        drive, w = self.space.reference.drive, 2.0 * np.pi * frequency
        does, goes = (
            np.array([amplitude(x[:, j], t, frequency) for j in drives])
            for x in (torque, signals[SPEED])
        )
        moved = np.minimum(does, w * drive.rotor_inertia[drives] * goes)
        whole, own = does / drive.coulomb[drives], moved / drive.coulomb[drives]
        loudest = int(drives[np.argmax(own if own.max() > MOVES * whole.max() else whole)])
        if loudest == clearest.joint:
            return clearest
        # What it shakes may ring a little beside it.
        frequency = refined(torque[:, loudest], t, f[at], f[1])
        sizes = course(torque[:, loudest], t, frequency)
        return Line(loudest, frequency, clearest.ratio, sizes)

    def _root(self, line: Line, t: Array, signals: Array) -> Line:
        """The swing below all lines of which this one is an odd multiple, where it is one.

        Friction turns over with its joint, and makes them of a swing that is too slow for a line:
        the joint swings at that in earnest, and faster than at the multiple.
        """
        v, torque = signals[SPEED, :, line.joint], signals[TORQUE, :, line.joint]
        width, speed = 1.0 / float(t[-1] - t[0]), amplitude(v, t, line.frequency)
        for order in ODD:
            frequency = refined(v, t, line.frequency / order, ROOT * width)
            if not 2.0 * width < frequency < self.rule.lowest + width:
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
            # a gear that turns faster than half the rate is heard folded back
            for low, high in ((a, b), (2.0 * nyquist - b, 2.0 * nyquist - a)):
                steady = hi - lo < STEADY * hi
                near = (f[:, None] > (1.0 - BAND) * low) & (f[:, None] < (1.0 + BAND) * high)
                allowed &= ~(near & steady & (hi > SLOW))
        return allowed


def _together(seen: Sequence[Line]) -> list[list[Line]]:
    """Lines of one frequency, which one loop makes: it shakes other joints, too. Clearest first."""
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
    """What is usual after another spectrum (3, F, J) at t [s]; of joints that ring as before."""
    usual, looks = before.power if before.looks else whole, before.looks + 1.0
    slow = LEARNT * WINDOWS[window] / window
    gain = np.where(whole > LOUD * usual, slow, max(slow, 1.0 / looks))
    learnt = usual + gain * (np.minimum(whole, LOUD * usual) - usual)
    return Usual(np.where(ringing, usual, learnt), looks, t + EARLY * WINDOWS[window])
