"""The request for an excitation, and its result."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.errors import InputError
from urdyn.identify.excite.criterion import CRITERIA, judge
from urdyn.identify.excite.expected import Expected, expected
from urdyn.identify.excite.parallel import search
from urdyn.identify.excite.poses import poses
from urdyn.identify.excite.probe import probe
from urdyn.identify.excite.proof import Proof, Safe, prove
from urdyn.identify.excite.question import Question, question
from urdyn.identify.excite.rating import scale
from urdyn.identify.excite.restart import Found, Task, loaded
from urdyn.identify.fit import Fit
from urdyn.model.arm import Arm
from urdyn.model.cell import STANDING, Cell, Solid
from urdyn.model.collision import MARGIN, collider
from urdyn.model.dynamics import Dynamics
from urdyn.progress import Progress, silent
from urdyn.simulate import Payload
from urdyn.simulate.fourier import HARMONICS, PERIOD, Series
from urdyn.simulate.limits import Limits, comfortable, rated
from urdyn.simulate.moves import Moves
from urdyn.simulate.trajectory import Trajectory, grid
from urdyn.simulate.written import LONGEST

KINDS = ("fourier", "probe", "poses")
RESTARTS = 4
ALIKE = 2.5  # [-] of log volume, about 2 % of every sd, within which motions are equally good
RATED = 200  # moments of a period for its condition number
SHORTEST = 2.0  # [s] of a run

HARMONICS_TRIED = (HARMONICS + 3, HARMONICS, HARMONICS + 6)  # by restarts in turn


@dataclass(frozen=True, eq=False)
class Ask:
    """Which kind of motion is wanted, for what, and where."""

    kind: str = "fourier"
    duration: float = 20.0  # [s]
    rate: float = 500.0  # [Hz] of the controller, and of the future log
    criterion: str = "D"
    interest: tuple[str, ...] = ()  # by name; none: all that motion can show
    joint: int = 0  # of a probe
    payload: Payload | None = None
    cell: Cell = STANDING
    margin: float = MARGIN  # [m]
    limits: Limits | None = None  # None: the usual ones
    harmonics: int | None = None  # None: several are tried
    restarts: int = RESTARTS
    seed: int = 0
    twin: str = ""  # SHA-256 of the file of the twin whose knowledge it adds to

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"no kind {self.kind!r} of excitation; name one of {', '.join(KINDS)}")
        if self.criterion not in CRITERIA:
            known = ", ".join(CRITERIA)
            raise InputError(f"no criterion {self.criterion!r}; name one of {known}")
        if not SHORTEST <= self.duration <= LONGEST:
            raise InputError(f"{self.duration:g} s: a motion takes {SHORTEST:g} s to {LONGEST:g} s")
        if not 0.0 <= self.margin < 1.0:
            raise InputError(f"a margin of {self.margin:g} m; give one between 0 and 1")
        if not (np.isfinite(self.rate) and 10.0 <= self.rate <= 1000.0):
            raise InputError(f"a rate of {self.rate:g} Hz; controllers have 125 or 500")
        if self.restarts < 1 or (self.harmonics is not None and self.harmonics < 2):
            raise InputError("one restart or more, and two harmonics or more")


@dataclass(frozen=True, eq=False)
class Excitation:
    """A motion that is proven safe, and the information to expect from it."""

    ask: Ask  # with the limits used, and the payload in the cell
    question: Question
    path: Series | Moves
    trajectory: Trajectory  # at the controller's rate
    proof: Proof
    expected: Expected
    values: tuple[float | None, ...]  # of the restarts; None: not safe

    @property
    def arm(self) -> Arm:
        """The arm for which it is."""
        return self.question.point.arm

    @property
    def value(self) -> float:
        """The criterion, from all that identification will see."""
        return judge(self.ask.criterion, self.expected.information, self.question.asked)[0]


def excite(
    arm: Arm,
    ask: Ask | None = None,
    twin: Fit | None = None,
    progress: Progress = silent,
    processes: int = 1,
) -> Excitation:
    """The most informative motion that is found and can be proven safe.

    Args:
        twin: what is known already; the motion adds to it.
        progress: called with what is being done, and the share that is done.
        processes: number that search in parallel; the result does not depend on it.

    Raises:
        UnsafeMotionError: none of the motions tried can be proven safe.
    """
    asked, ask = _posed(arm, ask or Ask(), twin)
    if ask.kind == "fourier":
        return completed(asked, ask, *_fourier(asked, ask, progress, processes))
    return completed(asked, ask, *_slow(asked, ask), ())


def repeated(arm: Arm, ask: Ask, path: Series | Moves, twin: Fit | None = None) -> Excitation:
    """A motion that was found before, proven again.

    Args:
        twin: what it adds to, if anything: torques are proven with its links and its tool.

    Raises:
        InputError: the motion adds to a twin, and there is none.
        UnsafeMotionError: it cannot be proven safe here.
    """
    if ask.twin and twin is None:
        raise InputError("the motion adds to a twin, which tells its torques: name it by --twin")
    asked, ask = _posed(arm, ask, twin)
    return completed(asked, ask, path, prove(loaded(asked), path, _safe(asked, ask)), ())


def _posed(arm: Arm, ask: Ask, twin: Fit | None) -> tuple[Question, Ask]:
    """What is asked of an arm, and the request with its limits, and its payload in the cell."""
    asked = question(arm, ask.payload, twin, ask.interest, rate=ask.rate)
    limits, cell = bearable(asked.point, ask.limits), _with_payload(ask)
    return asked, replace(ask, limits=limits, cell=cell)


def completed(
    asked: Question,
    ask: Ask,
    path: Series | Moves,
    proof: Proof,
    values: tuple[float | None, ...],
) -> Excitation:
    """The excitation with its trajectory and the information to expect."""
    t = grid(ask.duration, ask.rate)
    trajectory = Trajectory(t, *path.at(t))
    return Excitation(ask, asked, path, trajectory, proof, expected(asked, trajectory), values)


def bearable(point: Dynamics, wished: Limits | None) -> Limits:
    """The limits wished for, with the torque that an arm's friction and rotors leave.

    Raises:
        InputError: the arm has no limits, or its maker allows less than is wished for.
    """
    limits, drive = wished or comfortable(point.arm), point.drive
    told = np.isfinite(limits.velocity) & np.isfinite(limits.torque)
    if not told.all():
        free = point.arm.joint_names[int(told.argmin())]
        raise InputError(f"{free} lacks a limit of velocity or effort; write both into its URDF")
    for name, unit in (("velocity", "rad/s"), ("acceleration", "rad/s²")):
        asked, most = getattr(limits, name), getattr(rated(point.arm), name)
        j = int(np.argmax(asked / most))
        if not asked[j] <= most[j]:
            joint = point.arm.joint_names[j]
            words = f"{name} of {asked[j]:.4g} {unit}: the maker allows {most[j]:.4g}"
            raise InputError(f"{joint}: {words}; ask for less")
    lost = (
        drive.coulomb + drive.viscous * limits.velocity + drive.rotor_inertia * limits.acceleration
    )
    left = (point.arm.effort_limit - lost) / (1.0 + drive.structural)
    if not (left > 0.0).all():
        j = int(left.argmin())
        words = f"friction and rotor take {lost[j]:.4g} N·m at {limits.velocity[j]:.4g} rad/s"
        raise InputError(
            f"{point.arm.joint_names[j]} is too weak for itself: {words}, its limit of effort is "
            f"{point.arm.effort_limit[j]:.4g} N·m; are its limits of effort and velocity right?"
        )
    return replace(limits, torque=np.minimum(limits.torque, left))


def _fourier(
    asked: Question, ask: Ask, progress: Progress, processes: int
) -> tuple[Series, Proof, tuple[float | None, ...]]:
    """The best of several restarts."""
    outcomes = search(_tasks(asked, ask), progress, processes)
    safe = [one for one in outcomes if isinstance(one, Found)]
    if not safe:
        raise next(one for one in outcomes if not isinstance(one, Found))
    best = _chosen(asked, ask, safe)
    values = tuple(one.value if isinstance(one, Found) else None for one in outcomes)
    return best.series, best.proof, values


def _tasks(asked: Question, ask: Ask) -> list[Task]:
    """One task per restart."""
    t_end = float(grid(ask.duration, ask.rate)[-1])
    period = t_end / max(1, round(t_end / PERIOD))
    assert ask.limits is not None
    return [
        Task(
            question=asked.doubted() if ask.criterion == "D" and not ask.interest else asked,
            cell=ask.cell,
            limits=ask.limits,
            margin=ask.margin,
            criterion=ask.criterion,
            rows=ask.duration * asked.rate,
            harmonics=ask.harmonics or HARMONICS_TRIED[k % len(HARMONICS_TRIED)],
            period=period,
            seed=(ask.seed, k),
        )
        for k in range(ask.restarts)
    ]


def _chosen(asked: Question, ask: Ask, safe: list[Found]) -> Found:
    """The best by the criterion; among nearly equal volumes, the best conditioned."""
    most = max(one.value for one in safe)
    if ask.criterion != "D" or ask.interest:
        return next(one for one in safe if one.value == most)
    ruler, rows = scale(asked), ask.duration * asked.rate

    def condition(one: Found) -> float:
        t = np.linspace(0.0, one.series.lasting, RATED, endpoint=False)
        return ruler.rate(*one.series.at(t), rows).condition

    return min((one for one in safe if one.value > most - ALIKE), key=condition)


def _slow(asked: Question, ask: Ask) -> tuple[Moves, Proof]:
    rng, arm, safe = np.random.default_rng(ask.seed), loaded(asked), _safe(asked, ask)
    if ask.kind == "probe":
        return probe(arm, safe, ask.joint, ask.duration, rng)
    return poses(arm, asked, safe, ask.criterion, ask.duration, rng)


def _safe(asked: Question, ask: Ask) -> Safe:
    assert ask.limits is not None
    return Safe(ask.limits, collider(loaded(asked), ask.cell, ask.margin), ask.margin)


def _with_payload(ask: Ask) -> Cell:
    """The cell, with the payload as a ball at the tool unless its shape is given."""
    if ask.payload is None or ask.cell.tool:
        return ask.cell
    ball = Solid("payload", "ball", np.array([ask.payload.radius]), xyz=ask.payload.com)
    return replace(ask.cell, tool=(ball,))
