"""A loop that rings: one line in the spectrum of a joint's current that stays where it is.

The last second is looked at twice a beat, and more seconds, in which weaker ones show. A line has
to stand out of its neighbours and of what this joint's spectrum is like as a rule, in both halves
of that time at the same frequency, and in more looks than one: motion that brakes and turns has
such by chance. Lines that the gear makes at this speed do not count, nor what a motion to and fro
may make (see `weave`), nor one of several: what befalls a joint in every period of a motion has
lines at its multiples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose import weave
from urdyn.diagnose.event import Event
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.space import Space
from urdyn.diagnose.swings import (
    Course,
    amplitude,
    bridged,
    course,
    floor,
    going_on,
    growth,
    lines,
    neighbourhood,
    parts,
    refined,
    spectrum,
)
from urdyn.model.friction import GEAR_RATIO
from urdyn.signal.stretches import GAP
from urdyn.types import Array, Mask

WINDOWS = {0.9: 0.125, 3.6: 0.25, 14.4: 1.0}  # [s], and from one look to the next
SHORTEST = min(WINDOWS)
HEARD = 4.0 / 3.0 * SHORTEST  # [s] after which a clear line is heard that has just begun
LOOKS = 2  # in a beat, at most
FEWEST = 24  # rows of the shortest: fewer, and no line is told from its neighbours
MOST = 2000  # rows of the longest: where samples are many, fewer seconds tell as much
HIGHEST = 60.0  # [Hz] no loop of a joint rings faster
LEARNT = 0.18  # [-] share of the usual spectrum, over a window's time; of the first looks theirs
LOUD = 4.0  # [-] times what is usual: what is, may be the fault, and is learnt slowly as that much
HALVES = 5.0  # [-] times its neighbours that the line stands out in each half
# Other lines, [-] times their neighbours: a motion repeats itself, no loop rings. Of more bins than
# these more are that loud by chance, as many as of so few that are louder by this power of them.
CROWD, BINS, BY_CHANCE = (3, 7.0), 50, 0.3
MOVES = 0.1  # [-] of a line's torque, what its own motion takes of a drive that rings
STAYS = 0.5  # [-] of its largest amplitude that a line has at least in each quarter
RISES = 0.2  # [-] of its last amplitude that one that grows has at first
FADED = 0.85  # [-] of its amplitude that a line has to keep
COHERENT = 0.8  # [-] of its amplitude that is left over the whole: it keeps its phase
GROWING = 0.05  # [1/s] a quarter in five seconds
SURELY = 3.0, 4  # [sd] of its growth by which a swing that grows or fades does, and quarters
NEAR = 1.0  # [Hz] that the same line may differ by: what a gear makes moves with its speed
KNOWN = 1.0  # windows of looks, from which on it is known what is usual
WITHIN = 0.25  # [-] of a window about its begin, in which a line began that all of it has
AGAIN = 5.0  # [s] of silence, after which the same line is another event
MISSED = 3.5  # looks, as long as which a line that was not told yet may go unseen
BAND = 0.06  # [-] about the gear's lines that does not count
STEADY = 0.2  # [-] of its speed by which a joint that makes a line may vary it
ORDERS = (1.0, 2.0, 4.0)  # of motor turns

Line = tuple[int, float, float, Array]  # joint, frequency, ratio, amplitudes by quarter


@dataclass(frozen=True, eq=False)
class Usual:
    """What a window's spectrum is like as a rule."""

    power: Array  # (3, F, J); of no size before one was heard
    looks: float = 0.0  # that it was learnt in
    due: float = -np.inf  # [s] when the next is


@dataclass(frozen=True)
class Ring:
    """The line that was heard last."""

    last: float = -np.inf  # [s] when
    frequency: float = 0.0  # [Hz]
    since: float = 0.0  # [s]
    within: float = 0.0  # [s] of which
    joint: int = 0  # that does most
    course: Course = ()  # [N·m] its amplitude of late
    told: bool = False
    whose: int | None = None  # the joint that was told of, if lines have not been silent since


@dataclass(frozen=True, eq=False)
class Heard:
    """The last seconds, and the usual spectra."""

    t: Array  # (n,)
    signals: Array  # (3, n, J) what the model leaves and torque as measured [N·m], speed [rad/s]
    usual: tuple[Usual, ...]  # of each window
    ring: Ring = Ring()


@dataclass(frozen=True, eq=False)
class Oscillation:
    """Finds a loop that rings: a line in a current's spectrum that stays where it is."""

    space: Space
    period: float  # [s] between rows
    rule: Mapping[str, float]  # as the rules have it

    def init(self) -> Heard:
        """Nothing heard yet."""
        nothing = np.zeros((3, 0, self.space.joints))
        usual = (Usual(nothing),) * len(self._windows)
        return Heard(np.zeros(0), nothing, usual)

    def ringing(self, state: Heard, t: float) -> Mask:
        """Which joint was told of, and rings still at t [s], (J,)."""
        rings = np.zeros(self.space.joints, dtype=bool)
        if state.ring.whose is not None:
            rings[state.ring.whose] = t - state.ring.last < AGAIN
        return rings

    def swung(self, state: Heard) -> Array:
        """From when to when joints ring, or may, (2, J) [s]; those that do not, from never on."""
        ring = state.ring
        span = np.full((2, self.space.joints), np.inf)
        span[:, ring.joint] = ring.since - ring.within, ring.last
        return span

    def step(self, state: Heard, rows: Rows, doubted: bool) -> tuple[Heard, list[Event]]:
        """A beat on; an event when a joint begins to ring.

        Args:
            doubted: a sensor is ill, which may be what rings; nobody is told meanwhile.
        """
        events = list[Event]()
        for part in parts(len(rows), min(LOOKS, len(rows))):
            state, more = self._listen(state, rows.part(part.start, part.stop), doubted)
            events += [replace(event, alarm=float(rows.t[-1])) for event in more]
        return state, events

    def _listen(self, state: Heard, rows: Rows, doubted: bool) -> tuple[Heard, list[Event]]:
        """Some rows on."""
        K, keep = self.space.reference.drive.gain, slice(-self._samples(self._windows[-1]), None)
        gap = len(state.t) and rows.t[0] - state.t[-1] > GAP * self.period
        old = slice(0, 0) if gap else slice(None)
        new = np.stack([K * rows.residual, K * rows.current, rows.v])
        before = state.signals[:, old]
        late = bridged(np.concatenate([before[:, -2:], new], axis=1))
        state = replace(
            state,
            t=np.concatenate([state.t[old], rows.t])[keep],
            signals=np.concatenate([before[:, :-2], late], axis=1)[:, keep],
        )
        usual, events = list(state.usual), list[Event]()
        for k, window in enumerate(self._windows):
            n = self._samples(window)
            few = len(state.t) < n or self._samples(SHORTEST) < FEWEST
            if few or state.t[-1] < usual[k].due:
                continue
            t, signals = state.t[-n:], state.signals[:, -n:]
            usual[k], line = self._judge(usual[k], window, t, signals)
            line = None if line and self._woven(line, window, state) else line
            if line:
                known = usual[k].looks * WINDOWS[window] > KNOWN * window
                state, more = self._told(state, line, t, window, known, doubted)
                events += more
        return replace(state, usual=tuple(usual)), events

    @property
    def _windows(self) -> tuple[float, ...]:
        """Those that are not too many rows."""
        return tuple(w for w in WINDOWS if w == SHORTEST or self._samples(w) <= MOST)

    def _samples(self, window: float) -> int:
        """Rows of a window."""
        return round(window / self.period)

    def _judge(
        self, before: Usual, window: float, t: Array, signals: Array
    ) -> tuple[Usual, Line | None]:
        """A window's spectrum as a rule with this one in it, and the line that lasts in it."""
        n = len(t)
        f: Array = np.asarray(np.fft.rfftfreq(n, self.period), dtype=np.float64)
        f = f[f <= HIGHEST]
        whole = spectrum(signals, len(f))
        usual = before.power if before.looks else whole
        beside = neighbourhood(whole)
        least = floor(beside, usual)
        ratio = whole / np.where(least > 0.0, least, np.inf)
        allowed = self._allowed(f, signals[2])
        torques = (whole[:2] / np.maximum(beside[:2], 1e-30)).max(axis=0)
        apart = np.where(allowed, torques, 0.0)
        halves = [lines(signals[:, part], len(f) // 2 + 1) for part in parts(n, 2)]
        seen = []
        for j in range(self.space.joints):
            if np.isfinite(signals[..., j]).all():
                about = ratio[..., j], allowed[:, j], f, [h[..., j] for h in halves]
                line = self._line(signals[..., j], t, *about)
                if line and _others(apart[:, j], line[0] / f[1]) < CROWD[0]:
                    seen.append((j, *line))
        loud = np.isin(np.arange(self.space.joints), [line[0] for line in seen])
        looks, due = before.looks + 1.0, float(t[-1]) + 0.9 * WINDOWS[window]
        slow = LEARNT * WINDOWS[window] / window
        gain = np.where(whole > LOUD * usual, slow, max(slow, 1.0 / looks))
        learnt = usual + gain * (np.minimum(whole, LOUD * usual) - usual)
        loudest = self._loudest(seen, t, signals[1:], f, ratio[:2].max(axis=0)) if seen else None
        return Usual(np.where(loud, usual, learnt), looks, due), loudest

    def _loudest(self, seen: list[Line], t: Array, does: Array, f: Array, ratio: Array) -> Line:
        """One line of all joints that ring together: that of the drive that does most.

        Of those in which it stands out, whether or not it passes all other tests there; and most to
        move itself, where one does: another, that holds its joint still, may have more to do.

        Args:
            does: torque as measured [N·m] and speed [rad/s], (2, n, J).
            ratio: of torques to what is usual, (F, J).
        """
        joint, frequency, clear, sizes = max(seen, key=lambda line: line[2])
        at, torque = round(frequency / f[1]), does[0]
        out = ratio[at - 1 : at + 2].max(axis=0) > HALVES
        out[[line[0] for line in seen]] = True
        drives = np.flatnonzero(out & np.isfinite(does).all(axis=(0, 1)))
        drive, w = self.space.reference.drive, 2.0 * np.pi * frequency
        swing = np.array([[amplitude(x[:, j], t, frequency) for j in drives] for x in does])
        moved = np.minimum(swing[0], w * drive.rotor_inertia[drives] * swing[1])
        whole, own = swing[0] / drive.coulomb[drives], moved / drive.coulomb[drives]
        loudest = int(drives[np.argmax(own if own.max() > MOVES * whole.max() else whole)])
        if loudest != joint:  # what it shakes may ring a little beside it
            frequency = refined(torque[:, loudest], t, f[at], f[1])
            sizes = course(torque[:, loudest], t, frequency)
        return loudest, frequency, clear, sizes

    def _told(
        self, state: Heard, line: Line, t: Array, window: float, known: bool, doubted: bool
    ) -> tuple[Heard, list[Event]]:
        """One event for all joints that ring together.

        What long windows see by chance they see again for as long as they overlap.

        Args:
            known: what is usual in this window.
        """
        now, (joint, frequency, ratio, sizes) = float(t[-1]), line
        ring = state.ring
        silence = AGAIN if ring.told else MISSED * WINDOWS[window]
        same = now - ring.last < silence and abs(frequency - ring.frequency) < NEAR
        if not same:
            whose = ring.whose if now - ring.last < AGAIN else None
            ring = Ring(since=float(t[0]), within=WITHIN * window, joint=joint, whose=whose)
        sure = ratio >= self.rule["sure"]
        wait = self.rule["prompt" if sure and sizes.min() > STAYS * sizes.max() else "patience"]
        if not known or (window > SHORTEST and not sure):
            wait = 2.0 * window
        ring = replace(ring, last=now, frequency=frequency)
        if ring.told and joint != ring.joint:  # what it shakes
            return replace(state, ring=ring), []
        before = ring.course if joint == ring.joint else ()
        after = going_on(before, t, sizes)
        lasts = now - ring.since > wait and (same or window == SHORTEST)
        goes_on, tell = ring.told, lasts and not doubted
        if tell and not goes_on:
            ring = replace(ring, told=True, whose=joint)
        ring = replace(ring, joint=joint, course=after)
        tell &= not goes_on or after != before
        return replace(state, ring=ring), [self._event(ring, ratio, goes_on)] if tell else []

    def _event(self, ring: Ring, ratio: float, goes_on: bool) -> Event:
        """A joint that rings, as it does by now."""
        noise = self.space.reference.drive.gain * self.space.noise * np.sqrt(2.0 * self.period)
        last, rate, sd = growth(ring.course, float(noise[ring.joint]))
        seen = len(ring.course) >= SURELY[1]  # fewer do not tell how they scatter
        clear = seen and abs(rate) > max(GROWING, SURELY[0] * sd)
        # One window may have the motion for a part of it; of what grows the last is the truest.
        size = last if clear else float(np.median([amplitude for _, amplitude, _ in ring.course]))
        evidence = {
            "frequency_Hz": ring.frequency,
            "amplitude_Nm": size,
            "growing": clear and rate > 0.0,
            "fading": clear and rate < 0.0,
            "growth_per_s": rate,
            "growth_sd": sd,
            "statistic": ratio,
            "threshold": float(self.rule["threshold"]),
        }
        what = ring.joint, ring.since, ring.last, 0.99, size, evidence, ring.within, goes_on
        return Event("controller_instability", *what)

    def _woven(self, line: Line, window: float, heard: Heard) -> bool:
        """Whether a motion to and fro may make this line."""
        joint, frequency, _, sizes = line
        span = slice(-self._samples(max(window, weave.LASTS)), None)
        quick = round(1.0 / self.rule["lowest"] / self.period)
        periods = weave.periods(heard.t[span], heard.signals[2, span], quick)
        coulomb = float(self.space.reference.drive.coulomb[joint])
        made = weave.by_friction(frequency * float(periods[joint]), coulomb)
        return weave.in_step(frequency, periods, window) or bool(sizes[2:].mean() < made)

    def _allowed(self, f: Array, v: Array) -> Mask:
        """Frequencies that neither the motion nor the gear makes, (F, J)."""
        nyquist, lowest = 0.5 / self.period, self.rule["lowest"] + f[1]  # a taper smears by a bin
        allowed = np.repeat((f >= lowest)[:, None], v.shape[1], axis=1)
        lo, hi = np.abs(v).min(axis=0), np.abs(v).max(axis=0)
        for order in ORDERS:
            a, b = (order * GEAR_RATIO / (2.0 * np.pi) * x for x in (lo, hi))
            # a gear that turns faster than half the rate is heard folded back
            for low, high in ((a, b), (2.0 * nyquist - b, 2.0 * nyquist - a)):
                steady = hi - lo < STEADY * hi
                near = (f[:, None] > (1.0 - BAND) * low) & (f[:, None] < (1.0 + BAND) * high)
                allowed &= ~(near & steady & (hi > 0.05))
        return allowed

    def _line(
        self, x: Array, t: Array, ratio: Array, allowed: Mask, f: Array, halves: list[Array]
    ) -> tuple[float, float, Array] | None:
        """Frequency, ratio and amplitudes by quarter of a line that lasts; None where none does."""
        least = (self.rule["least"], self.rule["least"], self.rule["swing"])
        for k in range(len(x)):
            masked = np.where(allowed, ratio[k], 0.0)
            at = int(np.argmax(masked))
            near = slice(max(at // 2 - 1, 0), at // 2 + 3)
            if masked[at] < self.rule["threshold"] or any(
                h[k, near].max() < HALVES for h in halves
            ):
                continue
            frequency = refined(x[k], t, f[at], f[1])
            sizes = course(x[k], t, frequency)
            if not _lasts(sizes, amplitude(x[k], t, frequency)):
                continue
            if sizes[-2:].mean() > least[k]:
                torque = sizes if k < 2 else course(x[1], t, frequency)
                return frequency, float(masked[at]), torque
        return None


def _others(ratio: Array, at: float) -> int:
    """Lines (F,) that stand out beside the one at this bin, and are none of its multiples."""
    inner = ratio[1:-1]
    loud = CROWD[1] * (len(ratio) / BINS) ** BY_CHANCE
    peak = (inner > loud) & (inner >= ratio[:-2]) & (inner > ratio[2:])
    there = np.flatnonzero(peak) + 1
    multiple = np.maximum(np.rint(there / at), 1.0)
    return int(np.count_nonzero(np.abs(there - multiple * at) > multiple + 1.0))


def _lasts(sizes: Array, whole: float) -> bool:
    """A line that neither fades nor was only passing, and keeps its phase."""
    there = sizes.min() > STAYS * sizes.max() or bool((np.diff(sizes) > 0.0).all())
    return bool(
        there and _gain(sizes) > FADED and _began(sizes) and whole > COHERENT * sizes.mean()
    )


def _began(sizes: Array) -> bool:
    """Whether a line is there from the first quarter on: a brake that begins later makes one."""
    return bool(sizes[0] > RISES * sizes[-1])


def _gain(sizes: Array) -> float:
    """Of amplitudes by quarter, from the first half to the last [-]."""
    return float(sizes[2:].mean() / sizes[:2].mean())
