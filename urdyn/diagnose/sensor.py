"""A current sensor that tells something else than the current: stuck, silent, noisy or erratic.

(One that is biased shows over time, among the slow kinds.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.event import CERTAIN, USELESS, Event
from urdyn.diagnose.fast_rules import SensorRule
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.space import Space
from urdyn.tracking.joint_motion import STANDING
from urdyn.types import MAD_TO_SD, Array, Mask

MODES = ("stuck", "dropped", "noisy", "erratic")
PASSING = MODES[:2]  # those of which it shows, from one row to the next, that they are over
ENOUGH = 24  # rows at least that tell of noise
# Rows at least, however far apart: a few repeat one value, or are lost, by chance.
SAME, LOST = 8.0, 3.0
COARSE = 0.06  # [s] between rows; further apart, neighbours tell of the motion
BELIEVED = 2.0  # [s] without a sign of illness, after which a sensor is believed again
HEALED = 5.0  # [s] the same, after which it is said to be well
NOTHING = 8.0  # [-] times the noise that is asked for, where a value of 0 tells nothing
# Times the noise that a single value is apart from the middle of two to each side, and that these
# are at most: no push of the arm is over within a row, where rows are as close as that [s], and no
# loop rings so. What all of them share, as another load, is nothing of the value.
APART, USUAL, CLOSE = 10.0, 4.0, 0.025
# [-] times the usual noise: single values that are far off are a part of it, and no push shows.
UNSTEADY = 2.0
FADES = 0.5  # [-] of the time for which noise is usual, that this takes off the time before
OFTEN, WITHIN = 5.0, 5.0  # values that are none within [s], from which on a sensor is erratic
FEW = 0.5  # values that are hardly remembered: the next one begins anew
SECOND = np.sqrt(6.0)  # sd of second differences of white noise, over its own


@dataclass(frozen=True, eq=False)
class Felt:
    """What sensors did of late."""

    last: Array  # (J,) [A]
    same: Array  # (J,) rows that the value was the same
    began: Array  # (J,) [s] of that
    slid: Array  # (J,) rows of it in which the joint slid
    silent: Array  # (J,) rows without a value
    went: Array  # (J,) [s] of that
    left: Array  # (n, J) [A] residuals of late, where a beat has few rows
    rough: Array  # (J,) [A] their noise
    loud: Array  # (J,) [s] for which that was too much; all of it where it was so by far
    grew: Array  # (J,) [s] when it was last about as usual
    torn: Array  # (J,) values of late that are none
    tore: Array  # (J,) [s] of the first of these
    ill: Array  # (4, J) [s] when each mode was last seen; -inf: never
    told: Mask  # (4, J) whether that was told
    times: Array  # (J,) how often it was silent for long enough to be told
    longest: Array  # (J,) [s] the longest of these


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
        return Felt(
            last=nan,
            same=zero,
            began=zero,
            slid=zero,
            silent=zero,
            went=zero,
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
        """Joints whose sensor is so noisy that little is told by single values, (J,)."""
        return np.asarray(state.rough > UNSTEADY * self.space.noise)

    def torn(self, rows: Rows) -> Mask:
        """Values that are none, (N, J): 0 where much is asked for, or far from all beside them.

        One joint at a time is its sensor's, all at once an arm without power; some are a push.
        """
        torn: Mask = (rows.current == 0.0) & (np.abs(rows.predicted) > NOTHING * self.space.noise)
        if self.period <= CLOSE:
            torn |= _off(rows.residual / self.space.noise)
        off = (rows.current == 0.0).all(axis=1)
        return np.where(off[:, None], True, torn & _single(torn))

    def step(
        self, state: Felt, rows: Rows, torn: Mask, ringing: Mask
    ) -> tuple[Felt, list[Event], Mask]:
        """A beat on; also which joints' values are not to be believed now, (J,).

        Args:
            rows: without the values that are none.
            torn: these, (N, J); those that nobody told are seen here.
            ringing: joints whose loop is known to ring, (J,): no sensor is noisy for that.
        """
        torn = torn | _lapses(state.last, rows.current)
        state, signs = self._signs(state, rows)
        state = self._tore(state, rows.t, torn)
        left = np.concatenate([state.left, rows.residual])[-max(ENOUGH, len(rows)) :]
        rough = _rough(state.rough, left) if self.period < COARSE else state.rough
        over = _alone(rough / self.space.noise) / self.rule.noisy
        weight = np.clip(over**2 - 1.0, -FADES, 1.0)  # a joint that rattles is a little over
        loud = np.maximum(state.loud + weight * len(rows) * self.period, 0.0)
        began = (state.loud > 0.0) | (rough > UNSTEADY * self.space.noise)
        grew = np.where(began, state.grew, rows.t[-1])
        state = replace(state, left=left[-ENOUGH:], rough=rough, loud=loud, grew=grew)
        noisy = (loud >= self.rule.lasting) & ~ringing
        erratic = torn.any(axis=0) & (state.torn > OFTEN) & ~self.unsteady(state)
        now = float(rows.t[-1])
        ill = np.where(np.vstack([signs, noisy, erratic]), now, state.ill)
        sick = now - ill < BELIEVED
        state, found = self.well(replace(state, ill=ill), now)
        for m, mode in enumerate(MODES):
            for j in np.flatnonzero(sick[m] & ~state.told[m]):
                if not (sick[:, j] & state.told[:, j]).any():  # a sensor that is ill is one fault
                    found += [self._event(state, mode, int(j), now)]
        untrue = sick[: MODES.index("erratic")].any(axis=0)  # what is left of that is a current
        return replace(state, told=sick), found, np.asarray(untrue)

    def well(self, state: Felt, now: float, enough: float = HEALED) -> tuple[Felt, list[Event]]:
        """Without what sensors had that show no sign of it for `enough` [s], and events of these.

        A sensor that is stuck shows it where its joint slides, and may be so elsewhere.
        """
        ill, tells = state.ill, np.isfinite(state.last) & (state.same < SAME)
        over = np.isfinite(ill) & (now - ill >= enough) & tells
        over[len(PASSING) :] = False
        over &= ~(now - ill < enough).any(axis=0)
        events = [
            Event(
                kind="sensor_fault",
                joint=int(j),
                onset=now,
                alarm=now,
                confidence=CERTAIN,
                size=0.0,
                evidence={"mode": MODES[m], "until_s": float(ill[m, j])}
                | (_silences(state, int(j)) if MODES[m] == "dropped" else {}),
                goes_on=True,
            )
            for m, j in np.argwhere(over)
        ]
        return replace(state, ill=np.where(over, -np.inf, ill)), events

    def _signs(self, state: Felt, rows: Rows) -> tuple[Felt, Array]:
        """Rows one by one: how long nothing changed, and how long nothing was told."""
        current = rows.current
        there = np.isfinite(current)
        before = np.vstack([state.last, current[:-1]])
        repeated = current == before
        sliding = repeated & (np.abs(rows.v) > STANDING)
        missing = ~there & there.any(axis=1, keepdims=True)  # a gap of the log is nobody's fault
        same, began = _runs(repeated, rows.t, state.same, state.began)
        slid, _ = _runs(sliding, rows.t, state.slid, state.began)
        silent, went = _runs(missing, rows.t, state.silent, state.went)
        stuck = slid >= max(SAME, self.rule.held / self.period)
        dropped = silent >= (enough := max(LOST, self.rule.silent / self.period))
        lasted = np.where(dropped, silent * self.period, 0.0)
        after = replace(
            state,
            last=current[-1],
            same=same[-1],
            began=began,
            slid=slid[-1],
            silent=silent[-1],
            went=went,
            times=state.times + np.count_nonzero(dropped & (silent - 1.0 < enough), axis=0),
            longest=np.fmax(state.longest, lasted.max(axis=0)),
        )
        return after, np.stack([stuck.any(axis=0), dropped.any(axis=0)])

    def _tore(self, state: Felt, t: Array, torn: Mask) -> Felt:
        """With the values of a beat that are none, which count ever less as time goes by."""
        kept = np.exp(-len(t) * self.period / WITHIN) * state.torn
        own = torn & _single(torn)
        first = (kept < FEW) & own.any(axis=0)
        tore = np.where(first, t[np.argmax(own, axis=0)], state.tore)
        return replace(state, torn=kept + own.sum(axis=0), tore=tore)

    def _event(self, state: Felt, mode: str, j: int, now: float) -> Event:
        if mode == "noisy":
            return self._noisy(state, j, now)
        match mode:
            case "stuck":
                onset, said = state.began, {"value_A": float(state.last[j])}
            case "dropped":
                onset, said = state.went, _silences(state, j) | {"anew_s": float(state.went[j])}
            case _:
                onset, said = state.tore, {"values": float(state.torn[j]), "within_s": WITHIN}
        return Event(
            kind="sensor_fault",
            joint=j,
            onset=float(onset[j]),
            alarm=now,
            confidence=CERTAIN,
            size=USELESS,
            evidence={"mode": mode} | said,
        )

    def _noisy(self, state: Felt, j: int, now: float) -> Event:
        """A sensor whose noise is a current as large as a part of what friction takes."""
        rough, usual = float(state.rough[j]), float(self.space.noise[j])
        drive = self.space.reference.drive
        own = float(np.sqrt(max(state.rough[j] ** 2 - usual**2, 0.0)))
        return Event(
            kind="sensor_fault",
            joint=j,
            onset=float(state.grew[j]),
            alarm=now,
            confidence=CERTAIN,
            size=own * float(drive.gain[j] / drive.coulomb[j]),
            evidence={"mode": "noisy", "noise_A": rough, "usual_A": usual},
            within=len(state.left) * self.period,  # noisy for a part of that it may look as usual
        )


def _silences(state: Felt, j: int) -> dict[str, float]:
    """How often a sensor was silent so far, and for how long at most."""
    return {"times": int(state.times[j]), "longest_s": float(state.longest[j])}


def _alone(ratio: Array) -> Array:
    """How much noisier each joint is than any other: an arm that shakes is no sensor."""
    ratio = np.nan_to_num(ratio)
    order = np.argsort(ratio)
    others = np.full_like(ratio, ratio[order[-1]])
    others[order[-1]] = ratio[order[-2]] if len(order) > 1 else 0.0
    return np.asarray(ratio / np.maximum(others, 1.0))


def _lapses(last: Array, current: Array) -> Mask:
    """Where a joint alone begins to tell nothing, (N, J), after a row in which it did.

    Args:
        last: what was told in the row before, (J,) [A].
    """
    missing = np.isnan(np.vstack([last, current]))
    return np.asarray(missing[1:] & ~missing[:-1] & _single(missing[1:]))


def _off(left: Array) -> Mask:
    """Values far from all beside them, which are about alike, (N, J); of (N, J) [-] of the noise.

    Beside what is not known, none: nobody could tell which of them is off.
    """
    padded, n = np.pad(left, ((2, 2), (0, 0)), mode="reflect"), len(left)
    around = np.array([padded[k : k + n] for k in (0, 1, 3, 4)])
    lo, hi = around.min(axis=0), around.max(axis=0)
    return np.asarray((np.abs(left - 0.5 * (lo + hi)) > APART) & (0.5 * (hi - lo) < USUAL))


def _single(torn: Mask) -> Mask:
    """Rows in which one joint's value is none, (N, 1)."""
    return np.asarray(np.count_nonzero(torn, axis=1, keepdims=True) == 1)


def _rough(before: Array, residual: Array) -> Array:
    """Noise between neighbours [A], from which no motion and no single jump is seen."""
    bent = np.abs(np.diff(residual, n=2, axis=0))
    known = np.isfinite(bent).sum(axis=0) >= ENOUGH // 2
    middle = np.full(bent.shape[1], np.nan)
    if known.any():
        middle[known] = np.nanmedian(bent[:, known], axis=0)
    return np.where(np.isnan(middle), before, MAD_TO_SD * middle / SECOND)


def _runs(sign: Mask, t: Array, before: Array, began: Array) -> tuple[Array, Array]:
    """Rows for which a sign has lasted by each, (N, J), and when what lasts at the end began."""
    at = np.arange(1, len(t) + 1)[:, None]
    broken = np.maximum.accumulate(np.where(sign, 0, at), axis=0)
    length = at - broken + np.where(broken == 0, before, 0.0)
    end = broken[-1]
    started = np.where(
        end == 0, np.where(before > 0.0, began, t[0]), t[np.minimum(end, len(t) - 1)]
    )
    return np.asarray(length), started
