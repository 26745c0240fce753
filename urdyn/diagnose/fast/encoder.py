"""An encoder that gives no angle while the others do: it is silent, or stuck.

(One whose zero jumps is in `encoder_zero`; one whose zero creeps is among the slow kinds.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.fast.sensor import HEALED
from urdyn.diagnose.kinds.event import USELESS, Event
from urdyn.diagnose.kinds.evidence import ENCODER
from urdyn.signal.stuck import APART
from urdyn.types import Array, Mask

LIKEWISE = 0.05  # [s] within which sensors fall silent together; angles are a row off


@dataclass(frozen=True, eq=False)
class Unseen:
    """Joints whose angles are missing, and those not yet well again."""

    since: Array  # (J,) [s]; NaN: its angle is known
    told: Mask  # (J,) reported as unknown
    last: Array  # (J,) [s] when a reported one was last unknown; -inf: never, or it is well
    back: Array  # (J,) [rad] the first angle after that; NaN: there was none
    moved: Array  # (J,) [rad] largest distance from that
    times: Array  # (J,) how often it was reported
    gone: Array  # (J,) [s] since when an angle or a current is unknown; NaN: both are known
    company: Array  # (J,) fewest joints that fell silent together, itself included
    longest: Array  # (J,) [s] its longest silence


def all_seen(joints: int) -> Unseen:
    """Every angle is known."""
    nan, zero = np.full(joints, np.nan), np.zeros(joints)
    never = np.full(joints, -np.inf)
    no, inf = np.zeros(joints, dtype=bool), np.full(joints, np.inf)
    return Unseen(
        since=nan,
        told=no,
        last=never,
        back=nan,
        moved=zero,
        times=zero,
        gone=nan,
        company=inf,
        longest=zero,
    )


def unseen(
    before: Unseen, t: float, silent: Mask, known: Mask, held: float
) -> tuple[Unseen, list[Event]]:
    """One instant on; an event for each encoder that has been silent for long.

    Args:
        silent: joints without an angle, (J,); if all of them are, it is a gap.
        known: joints with a current, (J,).
        held: [s] for which an angle may be missing.
    """
    alone = silent & ~silent.all()
    since = np.where(alone, np.fmin(before.since, t), np.nan)
    told = alone & (t - since >= held)
    new = told & ~before.told
    lost = (silent | ~known) & ~silent.all()
    gone = np.where(lost, np.fmin(before.gone, t), np.nan)
    near = np.abs(gone - since[:, None]) < LIKEWISE
    with_it = np.count_nonzero(near | np.eye(len(near), dtype=bool), axis=1)
    ill = told | (alone & np.isfinite(before.last))  # one that is not yet well starts again
    after = Unseen(
        since=since,
        told=told,
        last=np.where(ill, t, before.last),
        back=np.where(ill, np.nan, before.back),
        moved=np.where(ill, 0.0, before.moved),
        times=before.times + new,
        gone=gone,
        company=np.where(new, np.fmin(before.company, with_it), before.company),
        longest=np.where(told, np.fmax(before.longest, t - since), before.longest),
    )
    return after, [_event(after, j, t) for j in np.flatnonzero(new).tolist()]


def seen(before: Unseen, t: Array, q: Array, known: Mask) -> Unseen:
    """After instants t (N,) [s] at which all angles are known, (N, J) [rad].

    Args:
        known: joints with a current, (N, J).
    """
    before = _none_now(before, t, known)
    if not np.isfinite(before.last).any():
        return before
    back = np.where(np.isnan(before.back), q[0], before.back)
    return replace(before, back=back, moved=np.fmax(before.moved, np.abs(q - back).max(axis=0)))


def well(before: Unseen, t: float, enough: float = HEALED) -> tuple[Unseen, list[Event]]:
    """Without encoders that are well again at `t` [s], and an event for each.

    Motion alone shows that one is no longer stuck: it has moved further than rounding, and has
    given angles for `enough` [s].
    """
    over = np.isfinite(before.last) & (before.moved > APART) & (t - before.last >= enough)
    if not np.count_nonzero(over):
        return before, []
    events = [_event(before, j, t, over=True) for j in np.flatnonzero(over).tolist()]
    return replace(before, last=np.where(over, -np.inf, before.last)), events


def ever_unseen(
    before: Unseen, t: Array, silent: Mask, known: Mask, held: float
) -> tuple[Unseen, list[Event]]:
    """The same after many instants, (N,) [s] and (N, J), with or without missing angles."""
    state, events, last = before, list[Event](), -1
    for k in np.flatnonzero(silent.any(axis=1)).tolist():
        if k > last + 1:
            state = _none_now(state, t[last + 1 : k], known[last + 1 : k])
        state, new = unseen(state, float(t[k]), silent[k], known[k], held)
        events, last = events + new, k
    return state, events


def _none_now(state: Unseen, t: Array, known: Mask) -> Unseen:
    """After instants (N,) [s] at which all angles are known, and these currents, (N, J)."""
    n = len(t)
    ever, at = known.any(axis=0), n - 1 - np.argmax(known[::-1], axis=0)
    since = np.where(ever, t[np.minimum(at + 1, n - 1)], np.fmin(state.gone, t[0]))
    state = replace(state, gone=np.where(known[-1], np.nan, since))
    if np.isnan(state.since).all():
        return state
    nan = np.full_like(state.since, np.nan)
    return replace(state, since=nan, told=state.told & False)


def _event(state: Unseen, j: int, now: float, over: bool = False) -> Event:
    told = {
        "mode": ENCODER,
        "times": int(state.times[j]),
        "longest_s": float(state.longest[j]),
        "at_once": int(state.company[j]),
    }
    if over:
        told["until_s"] = float(state.last[j])
    else:
        told["anew_s"] = float(state.since[j])
    return Event(
        kind="sensor_fault",
        joint=j,
        onset=now if over else float(state.since[j]),
        alarm=now,
        size=0.0 if over else USELESS,
        evidence=told,
        goes_on=over,
    )
