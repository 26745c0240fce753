"""Motion -> Fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from urdyn.errors import IdentifiabilityError, InputError
from urdyn.given import given_a, given_each, given_motion
from urdyn.identify.design import blocks
from urdyn.identify.enough import dead, goes_somewhere, too_few
from urdyn.identify.fit import Fit
from urdyn.identify.instrument import steadied
from urdyn.identify.search import Run, search
from urdyn.model.arm import Arm
from urdyn.model.consistency import is_consistent
from urdyn.model.population import population
from urdyn.progress import Progress, silent
from urdyn.types import Array, Mask, Motion

POINT = 1e-9  # [m²] rounding error in the spread of a point mass


def identify(
    arm: Arm,
    *motions: Motion,
    loaded: Sequence[Run] = (),
    gain: Array | None = None,
    tool: Array | None = None,
    progress: Progress = silent,
) -> Fit:
    """Identify an arm from motions; what the data do not show keeps its prior.

    Args:
        motions: what `condition` made of logs of the bare arm, or of one with its tool.
        loaded: motions with a payload; one of known mass identifies the drive gains.
        gain: drive gains where they are known, (J,) [N·m/A].
        tool: inertials (10,), in the last joint's frame, of what the arm carried in all motions;
            None: unknown, and the last link is taken to contain it.
        progress: called with what is being done, and the share that is done.

    Raises:
        InputError: there is no motion; the gains are not one per joint, finite and above 0; the
            tool is not a body.
        IdentifiabilityError: nothing moves, or there are too few data.
    """
    given_a(arm, Arm, "arm", "as urdyn.load_arm(name) gives")
    runs = [*map(Run, motions), *(given_a(run, Run, "loaded", "of a motion") for run in loaded)]
    for run in runs:
        given_motion(run.motion)
    if not runs:
        raise InputError("no motion to identify from; give one, as urdyn.condition(log) gives")
    if gain is not None:
        gain = given_each(gain, "gain", (arm.joints,), "finite numbers above 0", _possible)
    if tool is not None:
        tool = _borne(tool)
    _check(arm, runs)
    # The matrices are small: linear algebra threads would wait for one another.
    with threadpool_limits(1):
        prepared = [replace(run, motion=steadied(_alive(run.motion))) for run in runs]
        return search(arm, prepared, gain, tool, progress)


def _alive(motion: Motion) -> Motion:
    """A motion without the currents of dead sensors, which would be taken for friction."""
    if not (ill := dead(motion.q, motion.current)).any():
        return motion
    return replace(motion, current=np.where(ill, np.nan, motion.current))


def _borne(tool: Array) -> Array:
    """Inertials (10,) of a tool, checked: none, a body, or a point mass; else InputError."""
    tool = given_each(tool, "tool", (10,))
    if tool.any() and not is_consistent(tool, -POINT):
        raise InputError(f"tool {tool}: takes a body's, as Payload(mass, com).inertials() gives")
    return tool


def _possible(gain: Array) -> Mask:
    """Whether a drive can have such a gain."""
    return (gain > 0.0) & np.isfinite(gain)


def _check(arm: Arm, runs: Sequence[Run]) -> None:
    typical = population(arm).typical()
    for run in runs:
        if why := typical.unlike(run.motion.current):
            raise IdentifiabilityError(f"{run.motion.source.path}: {why}")
        measured = np.isfinite(run.motion.current)
        if measured.any() and not run.motion.current[measured].any():
            raise IdentifiabilityError(
                f"{run.motion.source.path}: all currents are zero, which no arm that bears itself "
                "draws; record them"
            )
        if why := too_few(run.motion.current):
            raise IdentifiabilityError(f"{run.motion.source.path}: {why}")
    moving = [run.motion for run in runs if goes_somewhere(run.motion.q).any()]
    if not any(block.known.any() for motion in moving for block in blocks(typical, motion)):
        raise IdentifiabilityError(
            "no joint moves far enough in this log for friction and inertia to be identified; "
            "record an excitation trajectory in which every joint moves"
        )
