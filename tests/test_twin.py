"""The twin's file: what was saved is loaded, and what is broken is told in one line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from urdyn.errors import TwinError
from urdyn.identify import Fit
from urdyn.io import dump_toml
from urdyn.model.arm import Arm, read_arm
from urdyn.simulate import fourier
from urdyn.twin import ABOVE_ZERO, NOT_BELOW, Twin, document, fit_of
from urdyn.types import Source

MUTATIONS, PER_TEST = 200, 20


@pytest.fixture(scope="module")
def fit(identified: Fit) -> Fit:
    """A fit that says where it came from."""
    sources = (Source("one.csv", "ab" * 32, (3, 1200)), Source("ladung é.csv", "", None))
    return replace(identified, sources=sources)


@pytest.fixture(scope="module")
def text(fit: Fit) -> str:
    return dump_toml(document(fit))


@pytest.fixture(scope="module")
def brief(fit: Fit) -> str:
    """The same with a small belief, which is most of a file and all alike."""
    tables = document(fit)
    tables["belief"] = {
        "names": fit.names[:3],
        "mean": fit.belief.mean[:3],
        "covariance": fit.belief.cov[:3, :3],
    }
    return dump_toml(tables)


def loaded(text: str, folder: Path) -> Fit:
    path = folder / "twin.toml"
    path.write_text(text, encoding="utf-8")
    return Twin.load(path).fit


def test_a_twin_reads_back_as_it_was(fit: Fit, tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    Twin(fit.dynamics.arm, fit).save(path)
    back = Twin.load(path).fit
    for name in ("sd", "prior", "prior_sd", "payloads"):
        np.testing.assert_array_equal(getattr(back, name), getattr(fit, name))
    for name in ("sd", "scale", "dof", "ar", "slow", "keep"):
        np.testing.assert_array_equal(getattr(back.noise, name), getattr(fit.noise, name))
    np.testing.assert_array_equal(back.belief.mean, fit.belief.mean)
    np.testing.assert_array_equal(back.belief.cov, fit.belief.cov)
    np.testing.assert_array_equal(back.parameters.values, fit.parameters.values)
    for name in ("names", "terms", "sources", "n_samples", "rank", "n_parameters"):
        assert getattr(back, name) == getattr(fit, name)
    assert back.parameters.names == fit.parameters.names
    assert back.parameters.units == fit.parameters.units


def test_twins_are_equal_whose_files_are(fit: Fit, tmp_path: Path) -> None:
    twin = Twin(fit.dynamics.arm, fit)
    twin.save(tmp_path / "twin.toml")
    back = Twin.load(tmp_path / "twin.toml")
    assert back == twin and hash(back) == hash(twin) and back != fit
    other = replace(fit, n_samples=fit.n_samples + 1)
    assert Twin(fit.dynamics.arm, other) != twin


def test_a_twin_is_of_the_arm_of_its_fit(fit: Fit, ur10e: Arm) -> None:
    with pytest.raises(TwinError, match="the fit is of ur5e, not of this ur10e"):
        Twin(ur10e, fit)
    drawn = fit.dynamics.arm
    other = replace(drawn, urdf=drawn.urdf.replace("<robot", "<!-- mine --><robot", 1))
    with pytest.raises(TwinError, match="the fit is of ur5e of another drawing"):
        Twin(other, fit)


def test_a_twin_is_told_in_a_line(fit: Fit) -> None:
    said = repr(Twin(fit.dynamics.arm, fit))
    assert said == f"Twin: {fit!r}" and "\n" not in said and len(said) < 120
    for words in ("ur5e", "6 joints", f"{fit.n_samples} samples", "one.csv, ladung é.csv"):
        assert words in said


def test_masses_that_were_found_are_those_of_the_rigid_arm(fit: Fit) -> None:
    """And are told of lists as well."""
    rng, dynamics = np.random.default_rng(3), fit.dynamics
    q, v, a = rng.uniform(-1.0, 1.0, (3, 5, 6))
    loaded = replace(dynamics, payload=0.1 * dynamics.inertials[-1])
    expected = dynamics.arm.torque(q, v, a, loaded.loaded())
    np.testing.assert_array_equal(loaded.rigid.torque(q, v, a), expected)
    listed = loaded.rigid.torque(*(x[0].tolist() for x in (q, v, a)))
    np.testing.assert_array_equal(listed, expected[0])
    assert np.abs(dynamics.arm.torque(q, v, a) - expected).max() > 1e-3


def test_a_twin_that_was_read_predicts_the_same_current(
    fit: Fit, text: str, tmp_path: Path
) -> None:
    trajectory = fourier(fit.dynamics.arm, 5.0, 100.0, np.random.default_rng(0))
    motion = trajectory.at(trajectory.t)
    current = fit.dynamics.current(motion)
    back = loaded(text, tmp_path).dynamics.current(motion)
    np.testing.assert_allclose(back, current, rtol=0, atol=1e-12 * np.abs(current).max())


def test_saving_twice_writes_the_same_bytes(text: str, tmp_path: Path) -> None:
    assert dump_toml(document(loaded(text, tmp_path))) == text


def test_what_people_read_comes_first(text: str) -> None:
    tables = list(tomllib.loads(text))
    order = ["urdyn", "robot", "data", "log", "parameter", "model", "noise", "payloads", "belief"]
    assert tables == order
    assert max(len(line) for line in text.partition("[model]")[0].splitlines()) < 200


def test_an_arm_of_ones_own_travels_inside(fit: Fit, tmp_path: Path) -> None:
    arm = read_arm(fit.dynamics.arm.urdf.replace('name="ur5e"', 'name="mine"'), "mine")
    own = replace(fit, dynamics=replace(fit.dynamics, arm=arm))
    back = loaded(dump_toml(document(own)), tmp_path).dynamics
    assert back.arm.urdf == arm.urdf and back.arm.name == arm.name == "mine"
    still, tilted = np.zeros(6), np.linspace(0.1, 0.6, 6)
    tau = [d.arm.torque(tilted, still, still, d.inertials) for d in (back, fit.dynamics)]
    np.testing.assert_allclose(*tau, rtol=1e-12)


def test_an_arm_of_ones_own_travels_inside_under_a_library_arms_name(
    fit: Fit, tmp_path: Path
) -> None:
    urdf, n = re.subn(  # on a wall
        r'(<joint name="shoulder_pan_joint"(.|\n)*?<origin [^>]*rpy=")[^"]+',
        r"\g<1>1.57 0 0",
        fit.dynamics.arm.urdf,
    )
    arm = read_arm(urdf)
    own = replace(fit, dynamics=replace(fit.dynamics, arm=arm))
    back = loaded(dump_toml(document(own)), tmp_path).dynamics.arm
    assert n == 1 and back.name == arm.name == "ur5e"
    motion = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 20, 6))
    np.testing.assert_allclose(back.torque(*motion), arm.torque(*motion), rtol=1e-12)
    assert np.abs(arm.torque(*motion) - fit.dynamics.arm.torque(*motion)).max() > 1.0


def test_a_library_arm_does_not_carry_its_description(text: str) -> None:
    assert "urdf" not in tomllib.loads(text)["robot"]


def without(text: str, table: str) -> str:
    """The text without the tables of this name."""
    return re.sub(rf"\[\[{table}\]\]\n(.+\n)*", "", text)


# Substitutions in the text, each of which makes it say something impossible.
WRONG: dict[str, Callable[[str], str]] = {
    "no twin at all": lambda text: "a = 1\n",
    "an empty file": lambda text: "",
    "another format": lambda text: text.replace("format = 1", "format = 99"),
    "an unknown robot": lambda text: text.replace('"ur5e"', '"ur6x"'),
    "a link without mass": lambda text: re.sub(r'(_link.mass"\nvalue = )\S+', r"\g<1>0.0", text),
    "a negative inertia": lambda text: re.sub(r'(_link.Izz"\nvalue = )\S+', r"\g<1>-1.0", text),
    "a value that is none": lambda text: re.sub(r'(coulomb"\nvalue = )\S+', r"\g<1>nan", text),
    "a word for a number": lambda text: re.sub(r'(viscous"\nvalue = )\S+', r'\g<1>"a"', text),
    "a mass beyond all numbers": lambda text: re.sub(
        r'(_link.(mass|com_x)"\nvalue = )\S+', r"\g<1>1e308", text
    ),
    "an unknown number of samples": lambda text: re.sub(r"samples = \d+", "samples = inf", text),
    "a table that is none": lambda text: "parameter = []\n" + without(text, "parameter"),
    "a drive without gain": lambda text: re.sub(r'(\.gain"\nvalue = )\S+', r"\g<1>0.0", text),
    "a parameter twice": lambda text: text.replace("shoulder_link.mass", "shoulder_link.com_x"),
    "a parameter missing": lambda text: text.replace("elbow_joint.viscous", "elbow_joint.vicious"),
    "noise of five joints": lambda text: re.sub(r"(\nscale = \[)[^,]+, ", r"\1", text),
    "noise without power": lambda text: re.sub(r"(\nsd = \[)[^,]+", r"\g<1>-1.0", text),
    "a belief with a row missing": lambda text: re.sub(r"(covariance = \[\n).*\n", r"\1", text),
    "no belief": lambda text: text.partition("[belief]")[0],
    "terms of one joint": lambda text: re.sub(r"terms = \[(.|\n)*?\n\]", "terms = [[]]", text),
    "a term that nobody knows": lambda text: re.sub(r"terms = \[\n  \[", 'terms = [["x"', text),
}


@pytest.mark.parametrize("what", WRONG)
def test_an_impossible_twin_is_told(what: str, brief: str, tmp_path: Path) -> None:
    wrong = WRONG[what](brief)
    assert wrong != brief
    with pytest.raises(TwinError, match=r"twin\.toml"):
        loaded(wrong, tmp_path)


def of_parameter(name: str, column: str = "value") -> str:
    return rf'(\.{name}"\n(?:\w+ = .*\n)*?{column} = )\S+'


@pytest.mark.parametrize(
    ("pattern", "value", "said"),
    [
        (r"(\nar = )\[(.|\n)*?\n\]", "-1.0", "its noise is not that of 6 joints"),
        (r"\nscale = .*()", "", "has no scale"),
        (r"\nsd = \[.*()", "", "has no sd"),
        (r"\ntime_offset = .*()", "", "has no time_offset"),
        (r"(\n)sd(?= = [^\[])", "sdd", "has no sd;"),
        (r"(\nname = \")ur5e", "ur10e", "the published masses in it are those of ur5e"),
        (r"(elbow_joint\.)viscous", "vicious", "has no elbow_joint.viscous"),
        *((of_parameter(x), "-5.0", f"{x} is not above 0") for x in ABOVE_ZERO),
        *((of_parameter(x), "0", f"{x} is not above 0") for x in ABOVE_ZERO),
        *((of_parameter(x), "-1e-9", f"{x} is negative") for x in NOT_BELOW),
        (of_parameter("presliding_tail"), "1.5", "presliding_tail or keep"),
        (of_parameter("coulomb"), "1e300", "beyond all measure"),
        (of_parameter("gain"), "1e-300", "gain is not above 0"),
        (of_parameter("offset"), "true", "value is not in numbers"),
        (of_parameter("offset"), '"1.0"', "value is not in numbers"),
        (of_parameter("mass", "sd"), "-0.1", "sd is negative"),
        (of_parameter("mass", "prior_sd"), "-0.1", "prior_sd is negative"),
        (r"(time_offset = )\S+", "1e9", "time_offset"),
        (r"(friction_lead = )\S+", "-1e9", "friction_lead"),
        (r"(\ntime_offset = )\S+", "false", "time_offset is not in numbers"),
        (r"(\nkeep = )\S+", "1.0", "keep"),
        (r"(\ndof = \[)[^,\]]+", "2.0", "dof of its noise is not above 2"),
        (r"(\nslow = \[)[^,\]]+", "-2.0", "slow is negative"),
        (r"(inertials = \[\n  \[)[^,]+", "1e300", "beyond all measure"),
        (r"(inertials = \[\n  \[)[^,]+, ", "", "damaged twin"),
        (r"(covariance = \[\n  \[)[^,]+", "-1.0", "variance is negative"),
        (r"(covariance = \[\n  \[\S+ )[^,]+", "1e3", "a covariance is symmetric"),
        (r"(covariance = )\[(.|\n)*?\n\]", "[[1, 2, 0], [2, 1, 0], [0, 0, 1]]", "is no covariance"),
        (r"(\nnames = \[)[^,]+", '"shoulder_link.d1"', "two states of one name"),
        (r"(\nnames = \[)[^,]+", "7", "a state's name is text, not 7"),
        (r"(\nar = \[\n  \[)[^,\]]+", "2.0", "the noise of shoulder_pan_joint grows"),
        (r"(\njoints = \[)(.*?), (.*?), ", r'"x", "y", ', "its joints or links are not ur5e's"),
        (of_parameter("mass", "unit"), '"furlong"', "mass is in furlong and has to be in kg"),
        (r"(\nrank = )\d+", "1_000_000", "its rank is 1000000, of 84 columns"),
        (r"(\nsamples = )\d+", "-5", "it is of -5 samples"),
    ],
)
def test_what_an_edited_twin_says_wrong_is_named(
    pattern: str, value: str, said: str, brief: str, tmp_path: Path
) -> None:
    wrong, n = re.subn(pattern, lambda match: (match[1] or "") + value, brief, count=1)
    assert n == 1
    with pytest.raises(TwinError) as caught:
        loaded(wrong, tmp_path)
    told = str(caught.value)
    assert said in told and "__" not in told and "\n" not in told
    assert told.startswith(f"{tmp_path / 'twin.toml'}: ") and told.endswith(
        "identify the arm again"
    )


@pytest.mark.parametrize(
    "name", ["elbow_joint.coulomb", "wrist_1_joint.viscous", "elbow_joint.offset", "time_offset"]
)
def test_a_twin_that_contradicts_itself_says_in_which_number(name: str, text: str) -> None:
    """What is predicted would follow one number, and a tracker begin with the other."""
    tables = tomllib.loads(text)
    row = next(row for row in tables["parameter"] if row["name"] == name)
    row["value"] += row["sd"]
    said = f"twin.toml: {name} is {row['value']:.6g}, and by the mean of its belief "
    with pytest.raises(TwinError, match=re.escape(said)):
        fit_of(tables, "twin.toml")


def test_a_twin_that_was_rounded_to_three_digits_is_the_same(text: str) -> None:
    tables = tomllib.loads(text)
    for row in tables["parameter"]:
        row["value"] = float(f"{row['value']:.3g}")
    fit_of(tables, "twin.toml")


def test_a_twin_without_a_belief_in_its_drives_is_refused(text: str) -> None:
    tables = tomllib.loads(text)
    at = tables["belief"]["names"].index("elbow_joint.coulomb")
    tables["belief"]["names"][at] = "elbow_joint.other"
    with pytest.raises(TwinError, match=r"its belief has no elbow_joint\.coulomb"):
        fit_of(tables, "twin.toml")


def test_a_twin_has_one_time_offset(text: str) -> None:
    tables = tomllib.loads(text)
    tables["model"]["time_offset"] += 0.01
    with pytest.raises(TwinError, match=r"time_offset is .*, and by the mean of its belief"):
        fit_of(tables, "twin.toml")


def test_a_twin_may_be_edited_where_its_belief_follows(text: str) -> None:
    tables = tomllib.loads(text)
    row = next(row for row in tables["parameter"] if row["name"] == "elbow_joint.coulomb")
    at = tables["belief"]["names"].index("elbow_joint.coulomb")
    row["value"], tables["belief"]["mean"][at] = 7.34, 1.993
    assert fit_of(tables, "twin.toml").value("elbow_joint.coulomb") == 7.34


def test_a_truncated_twin_is_told(brief: str, tmp_path: Path) -> None:
    end = len(brief.rstrip()) - 1  # without its last bracket
    for length in np.random.default_rng(0).integers(0, end, 40):
        with pytest.raises(TwinError):
            loaded(brief[:length], tmp_path)


def mutated(text: str, rng: np.random.Generator) -> str:
    """The text with one thing wrong: characters, a line, a number, or a piece elsewhere."""
    at, length = int(rng.integers(len(text))), int(rng.integers(1, 40))
    lines = text.splitlines(keepends=True)
    row = int(rng.integers(len(lines)))
    match int(rng.integers(6)):
        case 0:
            return text[:at] + text[at + length :]
        case 1:
            return text[:at] + chr(rng.integers(32, 127)) + text[at + 1 :]
        case 2:
            return "".join(lines[:row] + lines[row + 1 :])
        case 3:
            return "".join(lines[: row + 1] + lines[row:])
        case 4:
            wild = rng.choice(["nan", "-inf", "1e308", "-1", "0", "true", '"x"', "[]", "{}"])
            lines[row] = re.sub(r"= .*", f"= {wild}", lines[row])
            return "".join(lines)
        case _:
            piece = text[at : at + length]
            return text[:at] + piece[::-1] + text[at + length :]


@pytest.mark.parametrize("seed", range(MUTATIONS // PER_TEST))
def test_a_damaged_twin_is_told_or_still_one(seed: int, brief: str, tmp_path: Path) -> None:
    """Whatever is in the file: a twin that predicts, or a TwinError; never anything else."""
    rng = np.random.default_rng(seed)
    for _ in range(PER_TEST):
        try:
            fit = loaded(mutated(brief, rng), tmp_path)
        except TwinError as error:
            assert "twin.toml" in str(error)
        else:
            assert np.isfinite(fit.dynamics.inertials).all()


def test_a_twin_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(TwinError, match="cannot be read"):
        Twin.load(tmp_path / "twin.toml")
