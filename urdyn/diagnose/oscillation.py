"""A loop that rings: one line in the spectrum of a joint's current that stays where it is.

The last second is looked at every beat. A line has to stand out of its neighbours and of what this
joint's spectrum is like as a rule, in both halves of that second at the same frequency; lines that
the gear makes at this speed do not count.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from urdyn.diagnose.event import Event
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.space import Space
from urdyn.model.friction import GEAR_RATIO
from urdyn.types import Array, Mask

WINDOW = 0.9  # [s]
HIGHEST = 60.0  # [Hz] no loop of a joint rings faster
NEIGHBOURS = 6  # bins to each side that make a line's neighbourhood
LEARNT = 0.05  # [-] of the usual spectrum, a beat
HALVES = 5.0  # [-] times its neighbours that the line stands out in each half
STAYS = 0.5  # [-] of its largest amplitude that a line has at least in each quarter
RISES = 0.2  # [-] of its last amplitude that one that grows has at first
COHERENT = 0.8  # [-] of its amplitude that is left over the whole: it keeps its phase
GROWING = 0.5  # [1/s]
SWING = 0.003  # [rad/s] that a joint which rings does at least
NEAR = 1.0  # [Hz] that the same line may differ by: what a gear makes moves with its speed
AGAIN = 5.0  # [s] of silence, after which the same line is another event
BAND = 0.06  # [-] about the gear's lines that does not count
STEADY = 0.2  # [-] of its speed by which a joint that makes a line may vary it
ORDERS = (1.0, 2.0, 4.0)  # of motor turns


Line = tuple[int, float, float, Array]  # joint, frequency, ratio, amplitudes by quarter


@dataclass(frozen=True, eq=False)
class Heard:
    """The last second, and the usual spectrum."""

    t: Array  # (n,)
    torque: Array  # (n, J) [N·m] as measured
    left: Array  # (n, J) [N·m] what the model leaves
    v: Array  # (n, J) [rad/s]
    usual: Array  # (2, F, J) of a second; of no size before one was heard
    rings: Array  # (4,) when something rang last [s], its frequency, since when, whether told


@dataclass(frozen=True, eq=False)
class Oscillation:
    """Settings."""

    space: Space
    period: float  # [s] between rows
    rule: Mapping[str, float]  # least, warning, critical [N·m]; threshold [nats]; lowest [Hz]

    @property
    def samples(self) -> int:
        """Rows of the window."""
        return round(WINDOW / self.period)

    def init(self) -> Heard:
        """Nothing heard yet."""
        J = self.space.joints
        nothing = np.zeros((0, J))
        return Heard(
            np.zeros(0),
            nothing,
            nothing,
            nothing,
            np.zeros((2, 0, J)),
            np.array([-np.inf, 0.0, 0.0, 0.0]),
        )

    def step(self, state: Heard, rows: Rows) -> tuple[Heard, list[Event]]:
        """A beat on; an event when a joint begins to ring."""
        K, keep = self.space.reference.drive.gain, slice(-self.samples, None)
        gap = len(state.t) and rows.t[0] - state.t[-1] > 5.0 * self.period
        old = slice(0, 0) if gap else slice(None)
        state = replace(
            state,
            t=np.concatenate([state.t[old], rows.t])[keep],
            torque=np.concatenate([state.torque[old], K * rows.current])[keep],
            left=np.concatenate([state.left[old], K * rows.residual])[keep],
            v=np.concatenate([state.v[old], rows.v])[keep],
        )
        if len(state.t) < self.samples or self.samples < 24:
            return state, []
        return self._judge(state)

    def _judge(self, state: Heard) -> tuple[Heard, list[Event]]:
        f: Array = np.asarray(np.fft.rfftfreq(self.samples, self.period), dtype=np.float64)
        f = f[f <= HIGHEST]
        signals = np.stack([state.left, state.torque])
        whole = _spectrum(signals, len(f))
        fresh = state.usual.shape[1] == 0
        usual = whole if fresh else state.usual
        floor = np.maximum(_neighbourhood(whole), usual)
        ratio = whole / np.where(floor > 0.0, floor, np.inf)
        allowed = self._allowed(f, state.v)
        halves = [_lines(signals[:, part], len(f) // 2 + 1) for part in _parts(self.samples, 2)]
        lines = []
        for j in range(self.space.joints):
            if np.isfinite(signals[..., j]).all():
                of = ratio[..., j], allowed[:, j], f, [h[..., j] for h in halves]
                lines += [
                    (j, *line) for line in [self._line(signals[..., j], state.t, *of)] if line
                ]
        loud = np.isin(np.arange(self.space.joints), [line[0] for line in lines])
        learnt = usual + LEARNT * (np.minimum(whole, 4.0 * usual) - usual)
        state = replace(state, usual=np.where(loud, usual, learnt))
        return self._told(state, lines) if lines else (state, [])

    def _told(self, state: Heard, lines: list[Line]) -> tuple[Heard, list[Event]]:
        """One event for all joints that ring together: that of the joint that swings most."""
        now = float(state.t[-1])
        _, frequency, ratio, sizes = max(lines, key=lambda line: line[2])
        joint = max(lines, key=lambda line: line[2])[0]
        swings = [_amplitude(v, state.t, frequency) for v in state.v.T]
        if max(swings) > SWING:
            joint = int(np.argmax(swings))
        last, before, since, told = state.rings
        same = now - last < AGAIN and abs(frequency - before) < NEAR
        since, told = (since, told) if same else (float(state.t[0]), 0.0)
        friction = self.space.reference.drive.coulomb[joint]
        gear = frequency > self.rule["gear"]
        strong = sizes[-1] > self.rule["strong" if gear else "weak"] * friction
        wait = self.rule["patience" if gear else "longer"]
        tell = not told and (strong or now - since > wait)
        state = replace(state, rings=np.array([now, frequency, since, float(told or tell)]))
        return state, [self._event(state, joint, frequency, ratio, sizes)] if tell else []

    def _allowed(self, f: Array, v: Array) -> Mask:
        """Frequencies that neither the motion nor the gear makes, (F, J)."""
        nyquist = 0.5 / self.period
        allowed = np.repeat((f >= self.rule["lowest"])[:, None], v.shape[1], axis=1)
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
        for k in range(2):
            masked = np.where(allowed, ratio[k], 0.0)
            at = int(np.argmax(masked))
            near = slice(max(at // 2 - 1, 0), at // 2 + 3)
            if masked[at] < self.rule["threshold"] or any(
                h[k, near].max() < HALVES for h in halves
            ):
                continue
            frequency = _refined(x[k], t, f[at], f[1])
            sizes = np.array([_amplitude(x[k, p], t[p], frequency) for p in _parts(len(t), 4)])
            if not _lasts(sizes, _amplitude(x[k], t, frequency)):
                continue
            if sizes[-2:].mean() > self.rule["least"]:
                return frequency, float(masked[at]), sizes
        return None

    def _event(self, state: Heard, j: int, frequency: float, ratio: float, sizes: Array) -> Event:
        growth = float(np.polyfit(np.arange(4) * WINDOW / 4, np.log(sizes), 1)[0])
        size = float(sizes[-2:].mean())
        evidence = {
            "frequency_Hz": frequency,
            "amplitude_Nm": size,
            "growing": growth > GROWING,
            "growth_per_s": growth,
            "statistic": ratio,
            "threshold": float(self.rule["threshold"]),
        }
        begin, end = float(state.rings[2]), float(state.t[-1])
        return Event("controller_instability", j, begin, end, 0.99, size, evidence)


def _lasts(sizes: Array, whole: float) -> bool:
    """A line that neither fades nor was only passing, and keeps its phase."""
    there = sizes.min() > STAYS * sizes.max() or bool((np.diff(sizes) > 0.0).all())
    fades = sizes[2:].mean() < 0.85 * sizes[:2].mean()
    return bool(
        there and not fades and sizes[0] > RISES * sizes[-1] and whole > COHERENT * sizes.mean()
    )


def _amplitude(x: Array, t: Array, frequency: float) -> float:
    """Of a swing of this frequency, beside a slow motion."""
    u = np.linspace(-1.0, 1.0, len(t))
    w = 2.0 * np.pi * frequency * (t - t[0])
    basis = np.stack([np.cos(w), np.sin(w), *(u**k for k in range(5))], axis=1)
    found = np.linalg.lstsq(basis, x, rcond=None)[0]
    return float(np.hypot(found[0], found[1]))


def _refined(x: Array, t: Array, frequency: float, width: float) -> float:
    """Frequency at which the swing is largest, within a bin."""
    tried = frequency + width * np.linspace(-0.8, 0.8, 9)
    return float(tried[int(np.argmax([_amplitude(x, t, f) for f in tried]))])


def _parts(n: int, count: int) -> list[slice]:
    ends = np.linspace(0, n, count + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(ends.tolist())]


def _spectrum(x: Array, count: int) -> Array:
    """Power of tapered stretches (..., n, J) at the lowest frequencies, (..., count, J)."""
    n = x.shape[-2]
    u = np.linspace(-1.0, 1.0, n)
    basis = np.linalg.qr(np.stack([np.ones(n), u, u**2], axis=1))[0]
    left = np.nan_to_num(x) - basis @ (basis.T @ np.nan_to_num(x))
    lines = np.fft.rfft(left * np.hanning(n)[:, None], axis=-2)
    return np.asarray(np.abs(lines[..., :count, :]) ** 2)


def _neighbourhood(power: Array) -> Array:
    """Mean that the neighbours of each bin suggest, were they noise: by their median."""
    reach = NEIGHBOURS + 2
    width = [(0, 0)] * (power.ndim - 2) + [(reach, reach), (0, 0)]
    padded = np.pad(power, width, mode="reflect")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis=-2)
    beside = np.delete(around, range(NEIGHBOURS, NEIGHBOURS + 5), axis=-1)
    return np.asarray(np.median(beside, axis=-1) / np.log(2.0))


def _lines(x: Array, count: int) -> Array:
    """How far each bin of a half stands out, (2, F, J)."""
    power = _spectrum(x, count)
    return np.asarray(power / np.maximum(_neighbourhood(power), 1e-30))
