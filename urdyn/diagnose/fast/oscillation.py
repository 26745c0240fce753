"""Loops that ring: one line in the spectrum of a joint's current that stays where it is.

The last second is examined twice per beat, and longer windows for weaker lines. A line that lasts
in a window (see `ringing_line`) must appear in several looks: motion that brakes and turns has such
by chance. Nor does a line count that a motion to and fro may make (see `weave`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.fast import weave
from urdyn.diagnose.fast.lasting_line import STAYS
from urdyn.diagnose.fast.ringing_line import NEAR, SPEED, WINDOWS, Line, LineSearch, Usual
from urdyn.diagnose.fast.swings import Course, bridged, going_on, growth, parts
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.fast_rules import RingingRule
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.space import Space
from urdyn.signal.stretches import GAP
from urdyn.types import Array, Mask

SHORTEST = min(WINDOWS)
HEARD = 4.0 / 3.0 * SHORTEST  # [s] after which a clear new line is detected
LOOKS = 2  # per beat, at most
FEWEST = 24  # rows of the shortest: with fewer no line is distinct from its neighbours
MOST = 2000  # rows of the longest: at high rates shorter windows show as much
GROWING = 0.05  # [1/s] a quarter in five seconds
SURELY = 3.0, 4  # [sd] of growth beyond which a swing surely grows or fades; quarters needed
KNOWN = 1.0  # windows of looks, after which the usual spectrum is known
WITHIN = 0.25  # [-] of a window about its start, in which a line present in all of it began
AGAIN = 5.0  # [s] of silence, after which the same line is another event
MISSED = 3.5  # looks for which a line not yet reported may be missed


@dataclass(frozen=True)
class Ring:
    """A detected line."""

    last: float = -np.inf  # [s] when last detected
    frequency: float = 0.0  # [Hz]
    since: float = 0.0  # [s] by which it has lasted
    first: float = 0.0  # [s] when it began, silences included
    within: float = 0.0  # [s] uncertainty of that
    joint: int = 0  # the one with most torque
    course: Course = ()  # [N·m] its recent amplitudes
    told: bool = False
    whose: int | None = None  # the joint reported, if lines have not been silent since

    @property
    def amplitude(self) -> float:
        """Recent amplitude [N·m]; a window may contain the motion only in part."""
        return float(np.median([amplitude for _, amplitude, _ in self.course]))

    def by(self, t: float, within: float) -> Ring:
        """Begun within `within` of t [s], if that is before it was thought to have begun.

        A weak line may first show in a short window, long after it began.
        """
        return replace(self, first=t, within=within) if t + within < self.first else self

    def going_on(self, line: Line, t: Array) -> Ring:
        """With this line at these times; another joint's amplitudes start a new course."""
        before = self.course if line.joint == self.joint else ()
        return replace(self, joint=line.joint, course=going_on(before, t, line.sizes))


@dataclass(frozen=True, eq=False)
class Heard:
    """The last seconds, and the usual spectra."""

    t: Array  # (n,)
    signals: Array  # (3, n, J) LEFT and TORQUE [N·m], SPEED [rad/s] of `ringing_line`
    usual: tuple[Usual, ...]  # of each window
    ring: Ring = Ring()  # the line detected last
    beside: tuple[Ring, ...] = ()  # others detected recently

    @property
    def rings(self) -> tuple[Ring, ...]:
        """Each line detected recently."""
        return (self.ring, *self.beside)

    def like(self, line: Line, missed: float, silent: float) -> Ring | None:
        """The same line as last detected: since `silent` [s] if reported, else since `missed`."""
        ring = min(self.rings, key=lambda ring: abs(line.frequency - ring.frequency))
        recent = ring.last > (silent if ring.told else missed)
        return ring if recent and abs(line.frequency - ring.frequency) < NEAR else None

    def louder(self, joint: int, size: float, missed: float) -> bool:
        """Whether a louder line [N·m] reported of a joint was detected since `missed` [s]."""
        told = (r for r in self.rings if r.told and r.joint == joint and r.last > missed)
        return any(r.amplitude > size for r in told)

    def after(self, ring: Ring) -> Heard:
        """With a line's present state, and others not silent; one reported line per joint."""
        others = (
            r
            for r in self.rings
            if ring.last - r.last < AGAIN
            and abs(ring.frequency - r.frequency) >= NEAR
            and not (ring.told and r.told and ring.joint == r.joint)
        )
        return replace(self, ring=ring, beside=tuple(others))


@dataclass(frozen=True, eq=False)
class Oscillation:
    """Finds loops that ring: lines in currents' spectra that stay where they are."""

    space: Space
    period: float  # [s] between rows
    rule: RingingRule

    @cached_property
    def search(self) -> LineSearch:
        """Finds the lines in a window."""
        return LineSearch(self.space, self.period, self.rule)

    def init(self) -> Heard:
        """Nothing detected yet."""
        nothing = np.zeros((3, 0, self.space.joints))
        usual = (Usual(nothing),) * len(self._windows)
        return Heard(np.zeros(0), nothing, usual)

    def ringing(self, state: Heard, t: float) -> Mask:
        """Joints that were reported and still ring at t [s], (J,)."""
        rings = np.zeros(self.space.joints, dtype=bool)
        rings[[r.whose for r in state.rings if r.whose is not None and t - r.last < AGAIN]] = True
        return rings

    def perhaps(self, state: Heard, t: float) -> Mask:
        """Joints that ring at t [s], or may: a line was detected lately, (J,)."""
        return np.asarray(t - self.swung(state)[1] < AGAIN)

    def swung(self, state: Heard) -> Array:
        """From when to when joints ring, or may, (2, J) [s]; inf to -inf where they do not."""
        span = np.repeat([[np.inf], [-np.inf]], self.space.joints, axis=1)
        for ring in state.rings:
            begin, end = span[:, ring.joint]
            span[:, ring.joint] = min(begin, ring.first - ring.within), max(end, ring.last)
        return span

    def step(self, state: Heard, rows: Rows, ill: Mask) -> tuple[Heard, list[Event]]:
        """One beat on; an event when a joint begins to ring.

        Args:
            ill: joints with a faulty sensor, (J,), which may cause the line: they are not reported.
        """
        events = list[Event]()
        for part in parts(len(rows), min(LOOKS, len(rows))):
            state, more = self._listen(state, rows.part(part.start, part.stop), ill)
            events += [replace(event, alarm=float(rows.t[-1])) for event in more]
        return state, events

    def _listen(self, state: Heard, rows: Rows, ill: Mask) -> tuple[Heard, list[Event]]:
        """State after some rows, and events."""
        remembered = max(self._windows[-1], weave.LASTS)
        K, keep = self.space.reference.drive.gain, slice(-self._samples(remembered), None)
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
            usual[k], lines = self.search.look(usual[k], window, t, signals)
            known = usual[k].looks * WINDOWS[window] > KNOWN * window
            for line in lines:
                if not self._woven(line, window, state):
                    doubted = bool(ill[line.joint])
                    state, more = self._told(
                        state, line, t, window=window, known=known, doubted=doubted
                    )
                    events += more
        return replace(state, usual=tuple(usual)), events

    @property
    def _windows(self) -> tuple[float, ...]:
        """Windows of not too many rows, [s]."""
        return tuple(w for w in WINDOWS if w == SHORTEST or self._samples(w) <= MOST)

    def _samples(self, window: float) -> int:
        """Rows of a window."""
        return round(window / self.period)

    def _told(
        self, state: Heard, line: Line, t: Array, window: float, known: bool, doubted: bool
    ) -> tuple[Heard, list[Event]]:
        """Report one event for all joints that ring together.

        Args:
            known: whether this window's usual spectrum is known.
        """
        now = float(t[-1])
        missed = now - MISSED * WINDOWS[window]
        like = state.like(line, missed, now - AGAIN)
        before = like or _begun(state, line, t, window)
        before = before.by(float(t[0]), WITHIN * window)
        before = replace(before, last=now, frequency=line.frequency)
        if before.told and line.joint != before.joint:  # a joint that it shakes
            return state.after(before), []
        ring = before.going_on(line, t)
        lasts = self._lasts(ring, line, window, known) and not doubted
        if ring.told:
            told = lasts and ring.course != before.course
            return state.after(ring), [self._event(ring, line.ratio, True)] if told else []
        # What a long window shows by chance recurs in those that overlap it.
        seen = like is not None or window == SHORTEST
        if lasts and seen and not state.louder(ring.joint, float(line.sizes.mean()), missed):
            ring = replace(ring, told=True, whose=ring.joint)
            return state.after(ring), [self._event(ring, line.ratio, False)]
        return state.after(ring), []

    def _lasts(self, ring: Ring, line: Line, window: float, known: bool) -> bool:
        """Whether a line has lasted for as long as its kind must."""
        # Without allowance for noise: a brake's line grows alike.
        steady = line.sizes.min() > STAYS * line.sizes.max()
        sure = line.ratio >= self.rule.sure
        wait = self.rule.prompt if sure and steady else self.rule.patience
        if not known or (window > SHORTEST and not sure):
            wait = 2.0 * window
        return ring.last - ring.since > wait

    def _event(self, ring: Ring, ratio: float, goes_on: bool) -> Event:
        """A ringing joint, in its present state."""
        noise = self.space.reference.drive.gain * self.space.noise * np.sqrt(2.0 * self.period)
        last, rate, sd = growth(ring.course, float(noise[ring.joint]))
        seen = len(ring.course) >= SURELY[1]  # fewer do not show their scatter
        clear = seen and abs(rate) > max(GROWING, SURELY[0] * sd)
        # Where an amplitude grows or fades, the last is the present one.
        size = last if clear else ring.amplitude
        evidence = {
            "frequency_Hz": ring.frequency,
            "amplitude_Nm": size,
            "growing": clear and rate > 0.0,
            "fading": clear and rate < 0.0,
            "growth_per_s": rate,
            "growth_sd": sd,
            "statistic": ratio,
            "threshold": float(self.rule.threshold),
        }
        return Event(
            kind="controller_instability",
            joint=ring.joint,
            onset=ring.first,
            alarm=ring.last,
            size=size,
            size_sd=self._unsure(ring, size, sd if clear else None) if seen else float("nan"),
            evidence=evidence,
            within=ring.within,
            goes_on=goes_on,
        )

    def _unsure(self, ring: Ring, size: float, growth_sd: float | None) -> float:
        """sd of an amplitude [N·m]: of a trend's end, or of a median; with the drive gain's.

        For n even points over T a line's end has sd 2 s / √n, and its slope √12 s / (√n T).
        """
        ends, sizes, _ = np.array(ring.course).T
        if growth_sd is None:
            own = np.sqrt(0.5 * np.pi / len(sizes)) * np.std(sizes, ddof=1)
        else:
            own = size * growth_sd * (ends[-1] - ends[0]) / np.sqrt(3.0)
        gain = self.space.cov.diagonal()[self.space.places["gain"]][ring.joint]
        return float(np.hypot(own, np.sqrt(gain) * size))

    def _woven(self, line: Line, window: float, heard: Heard) -> bool:
        """Whether a motion to and fro may make this line."""
        span = slice(-self._samples(max(window, weave.LASTS)), None)
        quick = round(1.0 / self.rule.lowest / self.period)
        periods = weave.periods(heard.t[span], heard.signals[SPEED, span], quick)
        coulomb = float(self.space.reference.drive.coulomb[line.joint])
        made = weave.by_friction(line.frequency * float(periods[line.joint]), coulomb)
        return weave.in_step(line.frequency, periods, window) or bool(line.sizes[2:].mean() < made)


def _begun(state: Heard, line: Line, t: Array, window: float) -> Ring:
    """A line detected for the first time, or after a silence."""
    begin, silent = float(t[0]), float(t[-1]) - AGAIN
    whose = state.ring.whose if state.ring.last > silent else None
    new = Ring(since=begin, first=begin, within=WITHIN * window, joint=line.joint, whose=whose)
    before = state.like(line, silent, silent)
    if before is None or before.joint != line.joint:
        return new
    return replace(new, first=before.first, within=before.within)
