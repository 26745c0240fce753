"""Values that do not fit one another make no value: one line names what, and what it had to be."""

from __future__ import annotations

import inspect
import pickle
import re
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdyn as ud
from urdyn import errors
from urdyn.dbn import AffineObservation, Joined, RandomWalk, Tick, compile_linear, figure2
from urdyn.errors import InputError
from urdyn.estimate import Kalman, Track, track
from urdyn.faults import ShiryaevRoberts, Whitened, stated_baseline
from urdyn.io.poses import Poses
from urdyn.model.arm import Arm
from urdyn.model.cell import Solid
from urdyn.model.population import population
from urdyn.signal import Scaling
from urdyn.simulate import Payload, Trajectory
from urdyn.tracking.step.abrupt_changes import no_evidence
from urdyn.types import Defect, Gaussian, Log, Motion, Parameters, Source

ONE, TWO, ROWS = np.ones(1), np.ones(2), np.ones((3, 6))
PRIOR = Gaussian(TWO, np.eye(2))


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda: Log(ROWS, {}), r"t has the shape \(3, 6\); time is one axis"),
        (lambda: Log([0, 1], {"actual_q": ROWS}), r"actual_q has .* \(3, 6\); t has 2 rows"),
        (lambda: Log(TWO, {"actual_q": TWO}), r"actual_q .* \(2,\); .* rows x joints"),
        (lambda: Motion(np.arange(3), *[ROWS] * 6, breaks=(7,)), r"breaks \(7,\): .* 1 to 2"),
        (lambda: Motion(np.arange(3), *[ROWS] * 6, breaks=(-1,)), r"breaks \(-1,\)"),
        (lambda: Log(np.array([0.0, 2.0, 1.0]), {}), "have to increase; that of row 2 does not"),
        (lambda: Motion(TWO, *[ROWS] * 6), r"q has the shape \(3, 6\); .* \(2, 6\)"),
        (lambda: Motion(np.arange(3), *[ROWS] * 5, ROWS[:, :5]), r"temperature .* \(3, 6\)"),
        (lambda: Parameters(ONE, ("a", "b"), ("A", "A")), r"values .* \(1,\); .* \(2,\)"),
        (lambda: Parameters(TWO, ("a", "b"), ("A",)), "2 names, 1 units"),
        (lambda: Parameters(TWO, ("a", "a"), ("A", "A")), "two parameters of one name"),
        (lambda: Gaussian(0.0, 1.0), r"mean has the shape \(\); .* a row"),
        (lambda: ud.load_arm(5), "no arm '5': name one of"),
        (lambda: ud.condition(LOG, half_window=30_000), "half_window 30000: .* from 1 to 3"),
        (lambda: Gaussian(TWO, np.eye(3)), r"cov .* \(3, 3\); .* \(2, 2\)"),
        (lambda: RandomWalk(("a", "b"), PRIOR, ONE), r"diffusion .* \(1,\); .* \(2,\)"),
        (lambda: RandomWalk(("a",), PRIOR, ONE), r"the prior's mean .* \(2,\); .* \(1,\)"),
        (lambda: Track(("a", "b"), ONE, np.ones((1, 2)), ONE, ()), r"sd .* \(1,\); .* \(1, 2\)"),
        (
            lambda: Track(("a", "b"), ONE, *np.ones((2, 1, 2)), (), cov=np.eye(2)),
            r"cov .* \(2, 2\); .* \(1, 2, 2\)",
        ),
        (lambda: Payload(1.0, TWO), r"com .* \(2,\); .* \(3,\)"),
        (lambda: Poses(TWO, ROWS[:2, :3]), r"q has the shape \(2,\); .* poses x joints"),
        (lambda: Poses(ROWS, ROWS[:2, :3]), r"place .* \(2, 3\); .* \(3, 3\)"),
        (lambda: Poses(ROWS, ROWS[:, :3], ROWS), r"angles .* \(3, 6\); .* \(3, 3\)"),
        (lambda: Poses(ROWS, ROWS[:, :3], reading="foo"), "no reading foo; there are rotvec"),
        (lambda: Trajectory(TWO, *[ROWS] * 3), "from time 0"),
        (lambda: Trajectory(np.arange(2), *[ROWS] * 3), r"q .* \(3, 6\); .* \(2, 6\)"),
    ],
)
def test_what_does_not_fit_is_told_by_its_name(asked: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        asked()


def test_what_is_done_to_the_callers_arrays_changes_no_value() -> None:
    t, q, cov = np.arange(3.0), np.zeros((3, 6)), np.eye(1)
    log, motion = Log(t, {"actual_q": q}), Motion(t, *[q] * 6)
    walk = RandomWalk(("x",), Gaussian(np.zeros(1), cov), ONE)
    seen = AffineObservation(1, lambda u: np.eye(1), cov)
    held, go = Parameters(t, ("a", "b", "c"), ("m",) * 3), Trajectory(t, *[q] * 3)
    for array in (t, q, cov):
        array[:] = 99.0
    assert held["b"] == go.t[1] == 1.0 and not go.q.any()
    assert log.t[1] == motion.t[1] == 1.0 and not (log.channels["actual_q"] + motion.v).any()
    assert walk.prior.cov == seen.R == 1.0


def leaves(value: object) -> Iterator[object]:
    for held in vars(value).values():
        yield from held.values() if isinstance(held, Mapping) else (held,)


def test_a_copy_in_another_process_is_the_same_and_as_read_only() -> None:
    log = Log(np.arange(3), {"actual_q": ROWS}, Source("a.csv"), (Defect("gap", 1, 0, "kept"),))
    for value in (
        log,
        Motion(np.arange(3), *[ROWS] * 6, breaks=(1,)),
        Parameters(ONE, ("a",), ("A",)),
        PRIOR,
        Scaling({"actual_q": ONE}, {"actual_q": ONE}),
    ):
        for copied in (pickle.loads(pickle.dumps(value)), deepcopy(value)):
            had, has = ([*leaves(of)] for of in (value, copied))
            np.testing.assert_equal(has, had)
            assert not any(x.flags.writeable for x in has if isinstance(x, np.ndarray))


def test_an_error_in_another_process_says_the_same_and_carries_its_evidence() -> None:
    tree = {kind for kind in vars(errors).values() if inspect.isclass(kind) and kind is not Path}
    told: dict[type, tuple[object, ...]] = dict.fromkeys(tree, ("what to do",)) | {
        errors.LogError: ("torn", "a.csv", 3, "actual_q_0"),
        errors.RtdeError: ("silent", "robot:30004"),
        errors.UnsafeMotionError: ("a post", "reach", 1.5),
        errors.MissingExtraError: ("ros2", "mcap"),
    }
    for kind, evidence in told.items():
        error = kind(*evidence)
        sent = pickle.loads(pickle.dumps(error))
        assert (type(sent), str(sent), vars(sent)) == (kind, str(error), vars(error))


@pytest.mark.parametrize(
    "value",
    [
        Poses(ROWS, ROWS[:, :3], ROWS[:, 3:]),
        compile_linear(figure2(), {node.name: 1 for node in figure2().parameters}),
        Whitened(stated_baseline(0.0, ONE), ShiryaevRoberts()).init(1),
        no_evidence(6),
    ],
    ids=lambda value: type(value).__name__,
)
def test_nobody_writes_into_a_value(value: object) -> None:
    arrays = [held for held in leaves(value) if isinstance(held, np.ndarray)]
    assert arrays and not any(held.flags.writeable for held in arrays)


@pytest.mark.parametrize("verb", [ud.diagnose, ud.identify, ud.simulate])
def test_a_room_that_is_called_like_its_function_is_sent_and_told_as_one(verb: Any) -> None:
    assert pickle.loads(pickle.dumps(verb)) is verb
    name = verb.__name__.rpartition(".")[2]
    assert inspect.getdoc(verb) == inspect.getdoc(getattr(verb, name))


def test_values_that_hold_arrays_are_themselves_alone(ur5e: Arm) -> None:
    rows = np.zeros((1, 6))
    for value in (
        Gaussian(ONE, np.eye(1)),
        Parameters(ONE, ("a",), ("A",)),
        Log(ONE, {}),
        Motion(ONE, *[rows] * 6),
        (nominal := population(ur5e).typical()),
        nominal.drive,
        Payload(1.0),
        Solid("a", "ball", ONE),
        ud.Effort("A", ONE),
    ):
        assert {value} == {value} and value != replace(value)


def test_no_class_that_holds_arrays_is_compared_by_them() -> None:
    """NumPy's == is an array: as a truth it ends in an error, and what is compared has no hash."""
    held = re.compile(r"^    \w+: (?!.*Callable).*\b(Array|Index|Mask|ArrayLike)\b", re.MULTILINE)
    for path in Path(ud.__file__).parent.rglob("*.py"):
        for block in path.read_text().split("@dataclass(frozen=True)\n")[1:]:
            fields = block.partition("\n\n\n")[0].partition("    def ")[0]
            assert not held.search(fields), f"{path.name}: {block.splitlines()[0]} takes eq=False"


def test_what_is_masked_was_not_measured() -> None:
    readings = np.ma.masked_array([[0], [1000], [0]], [[0], [1], [0]])
    log = Log(np.arange(3), {"actual_q": readings})
    np.testing.assert_array_equal(log.channels["actual_q"], [[0.0], [np.nan], [0.0]])
    walk = RandomWalk(("x",), Gaussian(np.zeros(1), np.eye(1)), ONE)
    model = Joined(walk, AffineObservation(1, lambda u: np.eye(1), np.eye(1)))
    went = track(Kalman(), model, [Tick()] * 3, readings)
    assert (went["x"] == 0.0).all() and not went.innovations[1].measured


LOG = Log(np.arange(3), {"actual_q": ROWS, "actual_current": ROWS})
MOTION = Motion(np.arange(3), *[ROWS] * 6)
MET = Poses(ROWS[:, :5], ROWS[:, :3])
READ, CONDITIONED = "a Log, as urdyn.read", "a Motion, as urdyn.condition"


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda arm, fit: ud.condition("run.csv"), f"{READ}.*this is 'run.csv'"),
        (lambda arm, fit: ud.condition(MOTION), f"{READ}.*this is a Motion"),
        (lambda arm, fit: ud.identify(arm, LOG), f"{CONDITIONED}.*this is a Log"),
        (lambda arm, fit: ud.identify("ur5e", MOTION), "an Arm, as .*this is 'ur5e'"),
        (lambda arm, fit: ud.identify(arm, loaded=[MOTION]), "a Run, of a motion; this is a Mot"),
        (lambda arm, fit: ud.validate(fit, MOTION), f"{READ}.*this is a Motion"),
        (lambda arm, fit: ud.validate("twin.toml", LOG), "Twin.load.*this is 'twin.toml'"),
        (lambda arm, fit: ud.track(fit, "run.csv"), f"{READ}.*this is 'run.csv'"),
        (lambda arm, fit: ud.track("twin.toml", LOG), "Twin.load.*this is 'twin.toml'"),
        (lambda arm, fit: ud.diagnose("twin.toml", LOG), "Twin.load.*this is 'twin.toml'"),
        (lambda arm, fit: ud.calibrate(arm, MET), "poses are of 5 joints; ur5e has 6"),
        (lambda arm, fit: ud.Twin("ur5e", fit), "an Arm, as .*this is 'ur5e'"),
        (lambda arm, fit: ud.Twin(arm, arm), "a Fit, as .*this is a Arm"),
        (lambda arm, fit: arm.torque(*[["a"] * 6] * 3), "the motion holds text"),
        (lambda arm, fit: arm.torque(ROWS, ROWS[:2], ROWS), r"\(3, 6\), \(2, 6\)"),
        (lambda arm, fit: arm.torque(*[ROWS] * 3, ROWS), r"inertials .* \(3, 6\); .* \(6, 10\)"),
        (
            lambda arm, fit: arm.torque(*[ROWS] * 3, 0.0 * arm.inertials),
            r"inertials\[0, 0\] .*not 0",
        ),
        (lambda arm, fit: replace(fit.dynamics, inertials=ROWS), r"inertials .* \(6, 10\)"),
        (lambda arm, fit: replace(fit.dynamics, payload=ONE), r"payload .* \(10,\)"),
    ],
)
def test_what_is_of_another_kind_is_told_and_what_was_due(
    asked: Callable[[Arm, ud.Fit], object], said: str, ur5e: Arm, identified: ud.Fit
) -> None:
    with pytest.raises(InputError, match=said):
        asked(ur5e, identified)
