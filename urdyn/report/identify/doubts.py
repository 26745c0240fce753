"""Reasons to doubt a fit, or the logs that it is scored on, in a sentence each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.identify import Fit, Score
from urdyn.identify.another_load import another_load
from urdyn.model.population import KAPPA, KAPPA_SD
from urdyn.model.whose import misweighed
from urdyn.report.digits import interval90, number
from urdyn.report.evidence import UNSEEN, pool, seen, telling
from urdyn.report.names import joints
from urdyn.signal.channels import has_velocities, mean_measured
from urdyn.types import NORMAL90

LEVEL, LITTLE = 0.9, 0.5  # [-] coverage of the intervals; of that, in a wrong arm's twin
FAR = 4.0  # [sd] of the spread within a type: right arms were within 1.3, others beyond 4
APART = 0.02  # [s] further than recorders put streams: few rows a second cost up to 7 ms, too
WARMER = 5.0  # [K] beyond which viscous friction changes by more than the 7 % of any other day
NOTHING = 100.0  # [%] error of a model that predicts zero
WORSE = 2.0  # [-] times the controller's error; fits to sound logs were at 1.02 at most
PIECE = 0.2  # [-] of a fit's residual, that a load explains: 0.05 in sound logs, 0.4 with pieces
MANY = (
    "{} of {} masses and drive gains are what such arms hardly have: this is no {}, or it "
    "is mounted otherwise than its URDF says, or its currents are not in A; do not use this twin "
    "before that is known"
)
UNNAMED_TOOL = "a tool is mounted, and is part of this twin, within the last link"
MISNAMED_TOOL = "the tool has another mass or centre than was named"
UNEXPLAINED = (
    "no model of a {} explains the currents of {} by this motion: columns may be swapped, in "
    "another order of the joints, or of another quantity, sign or zero; or the arm is mounted "
    "otherwise than its URDF says; do not use this twin before that is known"
)
STRANGE = (
    "In {} intervals for 90 % of the currents hold less than half of that: it has changed since it "
    "was commissioned, or something pushed or pulled at the arm (--contact leaves such rows out), "
    "or its columns are another joint's, or of another sign"
)
PICKED = (
    "{}: from stamp {:.1f} s on the tool seems to bear another load, which explains {:.0f} % of "
    "what the fit leaves: use the rows before or after that alone (--rows); or the arm worked in "
    "contact: commission on a free motion"
)
SLOPES = (
    "no velocities are in {}: they were taken from the angles, with less accurate accelerations; "
    "record actual_qd"
)
SMOOTH = (
    "currents of {} were low-passed: their noise, on which intervals rest, is gone, and friction "
    "where joints reverse is smeared; record them unfiltered, as `urdyn record` does"
)
SKEWED = (
    "currents are {} ms {} beside the motion, more than recorders skew streams by, and friction "
    "and inertia may be as wrong: record both in one stream, at 100 Hz or more"
)
OTHERWISE_WARM = (
    "joints were up to {} K {} than in the twin's logs, which do not tell what warmth does to {}: "
    "prediction takes the usual effect, {:.1f} ± {:.1f} % of viscous friction per kelvin; better "
    "compare warm with warm"
)
UNLEARNT = (
    "the logs tell next to nothing of the friction of {}: where a joint hardly moved, its values "
    "and noise are only what is typical; diagnosis does not judge such joints"
)


def doubts(fit: Fit, scores: Sequence[Score]) -> list[str]:
    """Reasons to doubt a fit to these logs; empty where there are none."""
    return [
        *slopes(scores),
        *smooth(scores),
        *skewed(fit),
        *unlearnt(fit),
        *misnamed(fit, scores),
        *(unexplained(fit, scores) or picked(fit, scores)),  # a load is sought by a model that fits
        *unlike(fit),
    ]


def another(fit: Fit, scores: Sequence[Score]) -> str:
    """What low coverage of the intervals means; "" where it is as it should be."""
    held = pool(fit, telling(fit, scores)).coverage
    short, told = held < LITTLE * LEVEL, int(np.isfinite(held).sum())
    count = int(np.count_nonzero(short))
    if not count:
        return ""
    if 2 * count <= told:
        return STRANGE.format(_named(fit, short))
    return (
        f"In {count} of {told} joints intervals for 90 % of the currents hold less than half of "
        "that: this is not this arm's twin, or the arm carried something or worked in contact, or "
        "currents are not in A, or of the opposite sign"
    )


def misnamed(fit: Fit, scores: Sequence[Score]) -> list[str]:
    """Logs whose controller is another type of arm's, by the torques that it commands."""
    told = {s.log.source.path: misweighed(fit.dynamics.arm, s.log) for s in scores}
    return [f"{path}: {why}" for path, why in told.items() if why]


def otherwise_warm(fit: Fit, scores: Sequence[Score]) -> list[str]:
    """Logs of an arm colder or warmer than its twin, whose own effect of warmth is not known."""
    drive = fit.dynamics.drive
    each = np.array([mean_measured(s.log.joint("joint_temperatures")) for s in scores])
    apart = np.where(drive.thermal == 0.0, np.nan_to_num(each - drive.temperature), 0.0)
    most = float(apart.flat[np.argmax(np.abs(apart))])
    if abs(most) <= WARMER:
        return []
    which = _named(fit, np.abs(apart).max(axis=0) > WARMER)
    way = "warmer" if most > 0.0 else "colder"
    usual, half = 100.0 * KAPPA, 100.0 * NORMAL90 * KAPPA_SD
    return [OTHERWISE_WARM.format(number(abs(most)), way, which, usual, half)]


def unlearnt(fit: Fit) -> list[str]:
    """Joints about which next to nothing was learnt."""
    which = _named(fit, fit.unlearnt)
    return [UNLEARNT.format(which)] if which else []


def slopes(scores: Sequence[Score]) -> list[str]:
    """Logs without measured velocities."""
    logs = (score.log for score in scores)
    bare = [log.source.path for log in logs if not has_velocities(log)]
    return [SLOPES.format(", ".join(bare))] if bare else []


def smooth(scores: Sequence[Score]) -> list[str]:
    """Logs whose currents were low-passed."""
    bare = [score.log.source.path for score in scores if score.low_passed]
    return [SMOOTH.format(", ".join(bare))] if bare else []


def skewed(fit: Fit) -> list[str]:
    """Streams further apart than recorders put them."""
    offset = fit.dynamics.drive.time_offset
    if abs(offset) < APART:
        return []
    return [SKEWED.format(number(1e3 * abs(offset), 2), "early" if offset > 0.0 else "late")]


def unexplained(fit: Fit, scores: Sequence[Score]) -> list[str]:
    """Joints whose currents no fit explains, though it only needs to explain this motion."""
    own = _own(fit, scores)
    if not own:
        return []
    found = pool(fit, own)
    badly = (found.moving >= NOTHING) | (found.ours > WORSE * found.controller)
    which = _named(fit, badly)
    return [UNEXPLAINED.format(fit.dynamics.arm.name, which)] if which else []


def picked(fit: Fit, scores: Sequence[Score]) -> list[str]:
    """Logs of the fit with another load on the tool in a part of them."""
    each = [(score.log.source.path, *another_load(fit, score)) for score in _own(fit, scores)]
    return [
        PICKED.format(path, since, 100.0 * share) for path, share, since in each if share >= PIECE
    ]


def unlike(fit: Fit) -> list[str]:
    """Parameters implausible for such an arm: an undeclared tool, or another robot."""
    table, known = fit.parameters, np.where(fit.prior_sd > 0.0, fit.prior_sd, np.inf)
    own = (*fit.dynamics.arm.link_names, *fit.dynamics.arm.joint_names)  # of no payload
    sought = {f"{owner}.{quantity}" for owner in own for quantity in ("mass", "gain")}
    told = [name in sought for name in table.names]
    away = np.where(told, np.abs(table.values - fit.prior) / known, 0.0)
    at, arm = int(np.argmax(away)), fit.dynamics.arm.name
    if away[at] < FAR:
        return []
    many = int(np.count_nonzero(away >= FAR))
    if many > 1:
        return [MANY.format(many, sum(told), arm)]
    usual, here = interval90(fit.prior[at], fit.prior_sd[at]), number(table.values[at], 3)
    why = MISNAMED_TOOL if fit.tool_known else UNNAMED_TOOL
    return [
        f"{table.names[at]} is {here} {table.units[at]}, where such arms have {usual}: {why}; or "
        f"this is no {arm}, or its currents are not in A"
    ]


def _own(fit: Fit, scores: Sequence[Score]) -> list[Score]:
    """The scores of logs that the fit was made from."""
    return [score for score in scores if seen(fit, score.log.source) != UNSEEN]


def _named(fit: Fit, which: np.ndarray) -> str:
    return ", ".join(name for name, so in zip(joints(fit), which, strict=True) if so)
