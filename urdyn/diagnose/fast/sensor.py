"""A current sensor that does not report the current: stuck, silent, noisy or erratic.

One that clips is stuck wherever the current is beyond its limit, and nowhere else.

(One that is biased shows over time, among the slow kinds.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.fast import sensor_signs
from urdyn.diagnose.kinds.event import USELESS, Event
from urdyn.diagnose.kinds.evidence import CLIPPED
from urdyn.diagnose.kinds.fast_rules import SensorRule
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.space import Space
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Array, Mask

MODES = ("stuck", "dropped", "noisy", "erratic")
PASSING = MODES[:3]  # those whose end shows
# Least rows, at any rate: a few repeat one value, or are lost, by chance.
SAME, LOST = 8.0, 3.0
COARSE = 0.06  # [s] between rows; further apart, neighbours differ by the motion
BELIEVED = 2.0  # [s] without a sign of a fault, after which a sensor is trusted again
HEALED = 5.0  # [s] the same, after which it is reported well
NOTHING = 8.0  # [-] predicted current over noise, beyond which a value of 0 is invalid
SOMETHING = 3.0  # [-] the same for two in a row: coarse rounding gives 0 now and then below this
# [s] most between rows: no push is over within one, and no loop rings so fast
CLOSE = 0.025
# [-] times the sd of noise, beyond which single outliers are part of it, and no push shows.
UNSTEADY = 2.0
SOUND = 1.6  # [-] times the usual noise, up to which a sensor is about as usual
FADES = 0.5  # [-] share of a time of usual noise that is subtracted from the loud time
OFTEN, WITHIN = 5.0, 5.0  # invalid values within [s], beyond which a sensor is erratic
CLIPS = 2.0  # times stuck equally far from zero, from which that is its limit
FEW = 0.5  # invalid values, nearly forgotten: the next one starts again


@dataclass(frozen=True, eq=False)
class Felt:
    """Recent behaviour of sensors."""

    last: Array  # (J,) [A]
    heard: Mask  # (J,) whether it ever gave a value
    same: Array  # (J,) rows for which the value was the same
    began: Array  # (J,) [s] start of that
    slid: Array  # (J,) rows of it in which the joint slid
    held: Array  # (J,) [A] the value at which it was last stuck; NaN: never
    froze: Array  # (J,) [s] when that began
    again: Array  # (J,) how often it was stuck that far from zero, with no value beyond
    other: Mask  # (J,) whether it has given another value since
    beyond: Mask  # (J,) whether it has given a value further from zero since
    silent: Array  # (J,) rows without a value
    went: Array  # (J,) [s] start of that
    fell: Array  # (J,) [s] start of the last long enough to be reported
    company: Array  # (J,) fewest joints that fell silent together, itself included
    left: Array  # (n, J) [A] recent residuals, where a beat has few rows
    rough: Array  # (J,) [A] their noise
    loud: Array  # (J,) [s] for which that was too much, weighted by the excess
    grew: Array  # (J,) [s] when it was last about as usual
    torn: Array  # (J,) recent invalid values, decaying
    tore: Array  # (J,) [s] time of the first of these
    ill: Array  # (4, J) [s] when each mode was last seen; -inf: never
    told: Mask  # (4, J) whether that was reported
    times: Array  # (J,) how often it was silent for long enough to be reported
    longest: Array  # (J,) [s] longest of these silences


@dataclass(frozen=True, eq=False)
class SensorHealth:
    """Finds current sensors that are stuck, silent, noisy or erratic."""

    space: Space
    period: float  # [s] between rows
    rule: SensorRule

    def init(self) -> Felt:
        """Nothing seen yet."""
        J = self.space.joints
        nan, zero = np.full(J, np.nan), np.zeros(J)
        never = np.full((len(MODES), J), -np.inf)
        told = np.zeros((len(MODES), J), dtype=bool)
        no = np.zeros(J, dtype=bool)
        return Felt(
            last=nan,
            heard=no,
            same=zero,
            began=zero,
            slid=zero,
            held=nan,
            froze=zero,
            again=zero,
            other=no,
            beyond=no,
            silent=zero,
            went=zero,
            fell=zero,
            company=np.full(J, np.inf),
            left=np.zeros((0, J)),
            rough=nan,
            loud=zero,
            grew=zero,
            torn=zero,
            tore=zero,
            ill=never,
            told=told,
            times=zero,
            longest=zero,
        )

    def unsteady(self, state: Felt) -> Mask:
        """Joints whose sensor is so noisy that single values show little, (J,)."""
        return np.asarray(state.rough > UNSTEADY * self.space.noise)

    @cached_property
    def usual(self) -> Array:
        """Usual noise of sensors between neighbours, (J,) [A]."""
        covariance = self.space.covariance(2 * max(sensor_signs.APARTS), self.period)
        return sensor_signs.usually(covariance, self.space.colour.dof)

    def torn(self, rows: Rows) -> Mask:
        """Invalid values, (N, J): 0 where much is predicted, or far from all neighbours.

        For a sliding joint two zeros in a row are invalid where any current is predicted.

        One joint alone is its sensor's fault, all at once an arm without power; several are a push.
        """
        zero, asked = rows.current == 0.0, np.abs(rows.predicted) / self.space.noise
        torn: Mask = zero & (asked > NOTHING)
        torn |= sensor_signs.paired(zero & (asked > SOMETHING) & (np.abs(rows.v) > STANDING))
        if self.period <= CLOSE:
            torn |= sensor_signs.off(rows.residual / self.space.noise)
        off = zero.all(axis=1)
        return np.where(off[:, None], True, torn & sensor_signs.single(torn))

    def step(
        self, state: Felt, rows: Rows, torn: Mask, ringing: Mask
    ) -> tuple[Felt, list[Event], Mask]:
        """One beat on; also which joints' values are not trusted now, (J,).

        Args:
            rows: without the invalid values.
            torn: where these are, (N, J); single lost values are added here.
            ringing: joints whose loop rings, or may, (J,): their sensors do not count as noisy.
        """
        torn = torn | sensor_signs.lapses(state.last, rows.current)
        clipped = state.again >= CLIPS
        state, shown = self._signs(state, rows)
        clips = (state.again >= CLIPS) & ~clipped
        state, noisy = self._roughened(self._tore(state, rows.t, torn), rows, ringing)
        erratic = torn.any(axis=0) & (state.torn > OFTEN) & ~self.unsteady(state)
        now = float(rows.t[-1])
        ill = np.where(np.vstack([shown, noisy, erratic]), now, state.ill)
        sick = now - ill < BELIEVED
        state, found = self.well(replace(state, ill=ill), now)
        for m, mode in enumerate(MODES):
            anew = clips & (mode == "stuck")  # its kind shows only now
            for j in np.flatnonzero(sick[m] & (anew | ~state.told[m])):
                # A faulty sensor is one fault; one with many short silences is erratic.
                if anew[j] or mode == "erratic" or not (sick[:, j] & state.told[:, j]).any():
                    found += [self._event(state, mode, int(j), now)]
        untrue = sick[: MODES.index("erratic")].any(axis=0)  # others of an erratic one are currents
        return replace(state, told=sick), found, np.asarray(untrue)

    def well(self, state: Felt, now: float, enough: float = HEALED) -> tuple[Felt, list[Event]]:
        """Without faults that have shown no sign for `enough` [s], and events for these.

        A stuck sensor shows only where its joint slides, and may be stuck elsewhere; and one that
        has given nothing beyond the value at which it stuck may clip there. The end of an erratic
        one never shows.
        """
        ill, tells = state.ill, np.isfinite(state.last) & (state.same < SAME)
        over = np.isfinite(ill) & (now - ill >= enough) & tells
        over[len(PASSING) :] = False
        over[MODES.index("stuck")] &= state.beyond
        over &= ~(now - ill < enough).any(axis=0) & np.isinf(ill[len(PASSING) :]).all(axis=0)
        events = [
            Event(
                kind="sensor_fault",
                joint=int(j),
                onset=now,
                alarm=now,
                size=0.0,
                evidence={"mode": MODES[m], "until_s": float(ill[m, j])}
                | (_silences(state, int(j)) if MODES[m] == "dropped" else {}),
                goes_on=True,
            )
            for m, j in np.argwhere(over)
        ]
        return replace(state, ill=np.where(over, -np.inf, ill)), events

    def _signs(self, state: Felt, rows: Rows) -> tuple[Felt, Array]:
        """Row by row, for how long the value was unchanged, and for how long there was none."""
        current = rows.current
        there = np.isfinite(current)
        before = np.vstack([state.last, current[:-1]])
        repeated = current == before
        sliding = repeated & (np.abs(rows.v) > STANDING)
        missing = ~there & there.any(axis=1, keepdims=True)  # a gap of the log is no sensor's fault
        same, began = sensor_signs.runs(repeated, rows.t, state.same, state.began)
        slid, _ = sensor_signs.runs(sliding, rows.t, state.slid, state.began)
        silent, went = sensor_signs.runs(missing, rows.t, state.silent, state.went)
        stuck = slid >= (still := max(SAME, self.rule.held / self.period))
        dropped = silent >= (enough := max(LOST, self.rule.silent / self.period))
        lasted = np.where(dropped, silent * self.period, 0.0)
        fell = dropped & (silent - 1.0 < enough)
        after = replace(
            _stuck(state, current, stuck & (slid - 1.0 < still)),
            last=current[-1],
            heard=state.heard | there.any(axis=0),
            same=same[-1],
            began=began[-1],
            froze=np.where(stuck.any(axis=0), sensor_signs.last_of(began, stuck), state.froze),
            slid=slid[-1],
            silent=silent[-1],
            went=went[-1],
            fell=np.where(dropped.any(axis=0), sensor_signs.last_of(went, dropped), state.fell),
            company=np.fmin(state.company, sensor_signs.together(went, missing, fell)),
            times=state.times + np.count_nonzero(fell, axis=0),
            longest=np.fmax(state.longest, lasted.max(axis=0)),
        )
        return after, np.stack([stuck.any(axis=0), dropped.any(axis=0)])

    def _tore(self, state: Felt, t: Array, torn: Mask) -> Felt:
        """With the invalid values of a beat; their count decays with time."""
        kept = np.exp(-len(t) * self.period / WITHIN) * state.torn
        own = torn & sensor_signs.single(torn)
        first = (kept < FEW) & own.any(axis=0)
        tore = np.where(first, t[np.argmax(own, axis=0)], state.tore)
        return replace(state, torn=kept + own.sum(axis=0), tore=tore)

    def _roughened(self, state: Felt, rows: Rows, ringing: Mask) -> tuple[Felt, Mask]:
        """With the noise of a beat, and whether it has been too much for too long, (J,)."""
        left = np.concatenate([state.left, rows.residual])[-max(sensor_signs.ENOUGH, len(rows)) :]
        rough = sensor_signs.rough(state.rough, left) if self.period < COARSE else state.rough
        over = sensor_signs.noisier(rough / self.usual) / self.rule.noisy
        weight = np.clip(over**2 - 1.0, -FADES, 1.0)  # a joint that rattles is slightly over
        # One that was noisy for an hour is trusted as soon as one that was for seconds.
        most = self.rule.lasting + FADES * BELIEVED
        lasted = np.clip(state.loud + weight * len(rows) * self.period, 0.0, most)
        loud = np.where(ringing, 0.0, lasted)
        began = (state.loud > 0.0) | (rough > SOUND * self.usual)
        grew = np.where(began, state.grew, rows.t[-1])
        after = replace(state, left=left[-sensor_signs.ENOUGH :], rough=rough, loud=loud, grew=grew)
        return after, (loud >= self.rule.lasting) & (weight > 0.0)

    def _event(self, state: Felt, mode: str, j: int, now: float) -> Event:
        if mode == "noisy":
            return self._noisy(state, j, now)
        match mode:
            case "stuck":
                onset, said = state.froze, {"value_A": float(state.held[j])}
                mode = CLIPPED if state.again[j] >= CLIPS else mode
            case "dropped":
                onset, said = state.fell, _silences(state, j) | {"anew_s": float(state.fell[j])}
            case _:
                onset, said = state.tore, {"values": float(state.torn[j]), "within_s": WITHIN}
        return Event(
            kind="sensor_fault",
            joint=j,
            onset=float(onset[j]),
            alarm=now,
            size=USELESS,
            evidence={"mode": mode} | said,
        )

    def _noisy(self, state: Felt, j: int, now: float) -> Event:
        """The event of a noisy sensor, its size relative to Coulomb friction."""
        rough, usual = float(state.rough[j]), float(self.usual[j])
        drive = self.space.reference.drive
        own = float(np.sqrt(max(state.rough[j] ** 2 - usual**2, 0.0)))
        return Event(
            kind="sensor_fault",
            joint=j,
            onset=float(state.grew[j]),
            alarm=now,
            size=own * float(drive.gain[j] / drive.coulomb[j]),
            evidence={"mode": "noisy", "noise_A": rough, "usual_A": usual},
            within=len(state.left) * self.period,  # noisy for a part of that, it may look usual
        )


def _silences(state: Felt, j: int) -> dict[str, float]:
    """How often a sensor has been silent, for how long at most, and with how many others."""
    return {
        "ever_heard": bool(state.heard[j]),
        "times": int(state.times[j]),
        "longest_s": float(state.longest[j]),
        "at_once": int(state.company[j]),
    }


def _stuck(state: Felt, current: Array, told: Mask) -> Felt:
    """With the values at which sensors are found stuck, and those in between.

    Args:
        told: where one is found stuck, (N, J).
    """
    new = told.any(axis=0)
    held = np.where(new, sensor_signs.last_of(current, told), state.held)
    since = ~new | (np.arange(len(current))[:, None] > sensor_signs.last_row(told))
    apart = state.other | (~since & _differs(current, state.held)).any(axis=0)
    same = ~state.beyond & (np.abs(held) == np.abs(state.held))
    again = np.where(same, state.again + apart, 1.0)
    beyond = (since & (np.where(held < 0.0, -current, current) > np.abs(held))).any(axis=0)
    return replace(
        state,
        held=held,
        again=np.where(beyond, 0.0, np.where(new, again, state.again)),
        other=(state.other & ~new) | (since & _differs(current, held)).any(axis=0),
        beyond=(state.beyond & ~new) | beyond,
    )


def _differs(current: Array, held: Array) -> Mask:
    """Values other than that, (N, J)."""
    return np.asarray(np.isfinite(current) & (current != held))
