"""The twin of one arm, and its file: readable, versioned, with the hashes of what it came from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError, TwinError, UrdynError
from urdyn.given import given_a, given_covariance, given_names
from urdyn.identify.fit import Fit
from urdyn.identify.noise import Noise
from urdyn.identify.unknowns import unknowns_of
from urdyn.io import dump_toml, load_toml, write_text
from urdyn.model.arm import Arm, described, load_arm, read_arm
from urdyn.model.body import BODY, BODY_UNITS, about_frame, tensor
from urdyn.model.consistency import is_consistent
from urdyn.model.drive import LINEAR, SHAPE, UNITS, Drive
from urdyn.model.dynamics import Dynamics
from urdyn.model.library import names
from urdyn.model.population import OPTIONAL, population
from urdyn.types import Array, Gaussian, Parameters, Source
from urdyn.version import __version__

FORMAT = 1
COLUMNS = ("name", "value", "sd", "unit", "prior", "prior_sd")  # of a parameter
HUGE = 1e100  # beyond this, products of a few numbers overflow
PUBLISHED = 0.01  # [-] by which a published mass may be revised; other arms' masses differ by more
GROWTH = 1.01  # [-] per row, of noise; with slow noise, earlier versions wrote it just above 1
SKEW = 1.0  # [s] recorders skew their streams by far less
ROUNDED = 0.1  # [sd of its belief] by which a number may be off that was rounded by hand,
DIGITS = 5e-3  # [-] or relatively, with three digits
# Unit of a parameter, by the last word of its name.
UNIT_OF = dict(zip(BODY, BODY_UNITS, strict=True)) | UNITS | {"time_offset": "s"}
# Fields of a drive that are above 0, and fields that are 0 or more.
ABOVE_ZERO = ("gain", "coulomb", "presliding_distance", "stribeck_velocity")
NOT_BELOW = ("rotor_inertia", "viscous", "structural", "presliding_tail")
# What reading a damaged document raises.
DAMAGE = (LookupError, ArithmeticError, TypeError, ValueError, AttributeError)


@dataclass(frozen=True, eq=False)
class Twin:
    """An arm and what is known of it; twins are equal if their files are.

    Raises:
        TwinError: the fit is of another arm.
    """

    arm: Arm  # that of the fit
    fit: Fit

    def __post_init__(self) -> None:
        given_a(self.arm, Arm, "arm", "as urdyn.load_arm(name) gives")
        of = given_a(self.fit, Fit, "fit", "as urdyn.identify(arm, motion) gives").dynamics.arm
        if (self.arm.name, self.arm.urdf) != (of.name, of.urdf):
            told = of.name if of.name != self.arm.name else f"{of.name} of another drawing"
            raise TwinError(
                f"the fit is of {told}, not of this {self.arm.name}; give fit.dynamics.arm"
            )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Twin) and self._text == other._text

    def __hash__(self) -> int:
        return hash(self._text)

    def __repr__(self) -> str:
        return f"Twin: {self.fit!r}"

    @cached_property
    def _text(self) -> str:
        return dump_toml(document(self.fit))

    def save(self, path: str | Path) -> None:
        """Write the twin as TOML."""
        write_text(path, self._text)

    @classmethod
    def load(cls, path: str | Path) -> Twin:
        """Read a twin.toml.

        Raises:
            TwinError: the file is not a twin, or holds impossible values.
        """
        fit = fit_of(load_toml(path, TwinError), path)
        return cls(fit.dynamics.arm, fit)


def document(fit: Fit) -> dict[str, Any]:
    """A fit as nested tables: what people read first comes first."""
    arm, noise = fit.dynamics.arm, fit.noise
    table = fit.parameters
    rows = zip(table.names, table.values, fit.sd, table.units, fit.prior, fit.prior_sd, strict=True)
    tool = {"tool": {"inertials": fit.dynamics.payload}} if fit.tool_known else {}
    return {
        "urdyn": {"version": __version__, "format": FORMAT},
        "robot": {"name": arm.name, "joints": arm.joint_names, "links": arm.link_names}
        | described(arm),
        **tool,
        "data": {"samples": fit.n_samples, "rank": fit.rank, "columns": fit.n_parameters},
        "log": [_log(source) for source in fit.sources],
        "parameter": [dict(zip(COLUMNS, row, strict=True)) for row in rows],
        "model": {
            "time_offset": fit.dynamics.drive.time_offset,
            "friction_lead": fit.dynamics.drive.friction_lead,
            "temperature": fit.dynamics.drive.temperature,
            "terms": [sorted(terms) for terms in fit.terms],
        },
        "noise": {"sd": noise.sd, "scale": noise.scale, "dof": noise.dof, "ar": noise.ar}
        | {"slow": noise.slow, "keep": noise.keep},
        "payloads": {"inertials": [list(payload) for payload in fit.payloads]},
        "belief": {"names": fit.names, "mean": fit.belief.mean, "covariance": fit.belief.cov},
    }


def _log(source: Source) -> dict[str, Any]:
    rows = {"rows": list(source.rows)} if source.rows else {}
    return {"path": source.path, "sha256": source.sha256} | rows


def fit_of(tables: dict[str, Any], path: str | Path) -> Fit:
    """The fit in a `document`; whatever is wrong with it is a TwinError of one line."""
    header = tables.get("urdyn")
    written = header.get("format") if isinstance(header, dict) else None
    if written != FORMAT:
        raise TwinError(
            f"{path}: not a twin of format {FORMAT} but {written!r}; write it with `urdyn identify`"
        )
    try:
        with np.errstate(all="ignore"):  # overflow is reported below
            fit = _read(tables)
            fault = next(_faults(fit), "")
    except UrdynError as error:
        raise TwinError(f"{path}: {error}") from error
    except KeyError as error:
        raise TwinError(f"{path}: has no {error.args[0]}; identify the arm again") from error
    except DAMAGE as error:
        raise TwinError(
            f"{path}: damaged twin ({type(error).__name__}: {error}); identify the arm again"
        ) from error
    if fault:
        raise TwinError(f"{path}: {fault}; identify the arm again")
    return fit


def _faults(fit: Fit) -> Iterator[str]:
    """Impossible statements of a fit read from a file; each check presumes those before."""
    arm, noise, belief, drive = fit.dynamics.arm, fit.noise, fit.belief, fit.dynamics.drive
    table = (fit.parameters.values, fit.sd, fit.prior, fit.prior_sd)
    scatter = (noise.sd, noise.scale, noise.dof, noise.slow)
    times = np.array([drive.time_offset, drive.friction_lead])
    warm = np.nan_to_num(drive.temperature, posinf=np.inf)  # NaN: unknown
    borne = (fit.dynamics.payload, *fit.payloads)
    numbers = (*table, *scatter, noise.ar, belief.mean, belief.cov, *borne, times, warm)
    if not all((np.abs(x) < HUGE).all() for x in numbers):
        yield "a number in it is not finite, or beyond all measure"
    if len({x.shape for x in table}) > 1 or len(fit.names) != len(belief.mean):
        yield "names and numbers in it are not as many"
    if {x.shape for x in scatter} | {noise.ar.shape[:-1]} != {(arm.joints,)}:
        yield f"its noise is not that of {arm.joints} joints"
    if len(fit.terms) != arm.joints or not all(terms <= OPTIONAL for terms in fit.terms):
        yield f"its terms are not those of {arm.joints} joints"
    if (np.abs(times) > SKEW).any():
        yield f"its time_offset or friction_lead is beyond {SKEW:g} s"
    yield from _beneath(fit)
    yield from _unlike(fit)
    yield from _contradictory(fit)
    solid = [body for body in borne if body.any()]
    if not is_consistent(np.array([*fit.dynamics.inertials, *solid])).all():
        yield "no solid body has these masses"
    yield from _renamed(fit)
    if missing := [name for name in unknowns_of(fit).names if name not in fit.names]:
        yield f"its belief has no {missing[0]}"


def _unlike(fit: Fit) -> Iterator[str]:
    """Values that no identification writes."""
    for name, unit in zip(fit.parameters.names, fit.parameters.units, strict=True):
        if unit != (due := UNIT_OF.get(name.rpartition(".")[2], unit)):
            yield f"{name} is in {unit} and has to be in {due}"
    for joint, ar in zip(fit.dynamics.arm.joint_names, fit.noise.ar, strict=True):
        if (np.abs(np.roots([1.0, *-ar])) > GROWTH).any():
            yield f"by its ar the noise of {joint} grows without end"
    if not 0 <= fit.rank <= fit.n_parameters:
        yield f"its rank is {fit.rank}, of {fit.n_parameters} columns"
    if fit.n_samples < 0:
        yield f"it is of {fit.n_samples} samples"
    try:
        given_names(fit.names)
        given_covariance(fit.belief.cov, "belief.covariance")
    except InputError as error:
        yield str(error)


def _contradictory(fit: Fit) -> Iterator[str]:
    """Numbers of drives that are not what the belief says: tracking begins with the belief."""
    coordinates, drive = population(fit.dynamics.arm).drive, fit.dynamics.drive
    means = zip(fit.belief.mean, np.sqrt(np.diag(fit.belief.cov)), strict=True)
    belief = dict(zip(fit.names, means, strict=True))
    told = dict(zip(fit.parameters.names, fit.parameters.values, strict=True))
    for name, value in (*told.items(), ("time_offset", drive.time_offset)):
        field = name.rpartition(".")[2]
        if name not in belief or field == "presliding_tail":  # cut to what is possible
            continue
        mean, sd = belief[name]
        logarithm = field in coordinates and coordinates[field].positive
        x, off = (np.log(value), DIGITS) if logarithm else (value, DIGITS * abs(mean))
        if not abs(x - mean) <= off + ROUNDED * sd:
            due = f"exp({mean:.6g})" if logarithm else f"{mean:.6g}"
            yield f"{name} is {value:.6g}, and by the mean of its belief {due}"


def _renamed(fit: Fit) -> Iterator[str]:
    """A fault if the arm was renamed: the published masses stand in the file, too."""
    arm, said = fit.dynamics.arm, dict(zip(fit.parameters.names, fit.prior, strict=True))
    told = np.array([said[f"{link}.mass"] for link in arm.link_names])

    def are_of(other: Arm) -> bool:
        due = other.inertials[:, 0]
        return len(due) == len(told) and bool((np.abs(told - due) < PUBLISHED * due).all())

    if not are_of(arm):
        whose = next((name for name in names() if are_of(load_arm(name))), "another arm")
        yield f"it is named {arm.name}, and the published masses in it are those of {whose}"


def _beneath(fit: Fit) -> Iterator[str]:
    """Numbers below their bounds, and shares outside theirs."""
    noise, drive = fit.noise, fit.dynamics.drive
    above = {"sd of its noise": noise.sd, "scale of its noise": noise.scale}
    for name, x in (above | {name: getattr(drive, name) for name in ABOVE_ZERO}).items():
        if (x < 1.0 / HUGE).any():
            yield f"{name} is not above 0"
    spreads = {"sd": fit.sd, "prior_sd": fit.prior_sd, "slow": noise.slow}
    spreads |= {"variance": np.diag(fit.belief.cov)}
    for name, x in (spreads | {name: getattr(drive, name) for name in NOT_BELOW}).items():
        if (x < 0.0).any():
            yield f"{name} is negative"
    if (noise.dof <= 2.0).any():
        yield "dof of its noise is not above 2"
    if (drive.presliding_tail > 1.0).any() or not 0.0 <= noise.keep < 1.0:
        yield "presliding_tail or keep is no share"


def _read(tables: dict[str, Any]) -> Fit:
    robot, rows, noise = tables["robot"], tables["parameter"], tables["noise"]
    arm = read_arm(robot["urdf"], robot["name"]) if "urdf" in robot else load_arm(robot["name"])
    if [*robot["joints"]] != [*arm.joint_names] or [*robot["links"]] != [*arm.link_names]:
        raise TwinError(f"its joints or links are not {arm.name}'s; identify the arm again")
    column = {key: [row[key] for row in rows] for key in COLUMNS}
    parameters = Parameters(_numbers(column, "value"), tuple(column["name"]), tuple(column["unit"]))
    belief, data = tables["belief"], tables["data"]
    tool = _numbers(tables["tool"], "inertials") if "tool" in tables else np.zeros(10)
    return Fit(
        dynamics=_dynamics(arm, parameters, tables["model"], tool),
        payloads=tuple(_numbers(tables["payloads"], "inertials")),
        parameters=parameters,
        sd=_numbers(column, "sd"),
        prior=_numbers(column, "prior"),
        prior_sd=_numbers(column, "prior_sd"),
        names=tuple(belief["names"]),
        belief=Gaussian(_numbers(belief, "mean"), _numbers(belief, "covariance")),
        terms=tuple(frozenset(terms) for terms in tables["model"]["terms"]),
        noise=_noise(noise),
        sources=tuple(
            Source(log["path"], log["sha256"], tuple(log["rows"]) if "rows" in log else None)
            for log in tables.get("log", [])
        ),
        n_samples=int(_numbers(data, "samples")),
        rank=int(_numbers(data, "rank")),
        n_parameters=int(_numbers(data, "columns")),
        tool_known="tool" in tables,
    )


def _noise(table: dict[str, Any]) -> Noise:
    """The noise; older twins do not have its slow part."""
    told = {"slow": [], "keep": 0.0} | table
    sd, scale, dof, ar, slow = (_numbers(told, x) for x in ("sd", "scale", "dof", "ar", "slow"))
    return Noise(sd, scale, dof, ar, slow, float(_numbers(told, "keep")))


def _numbers(table: dict[str, Any], key: str) -> Array:
    """The numbers of a table under `key`; words, true and false are none."""
    found = np.array(table[key], dtype=object)
    if not all(type(x) in (int, float) for x in found.flat):
        raise TwinError(f"{key} is not in numbers; identify the arm again")
    return found.astype(np.float64)


def _dynamics(arm: Arm, parameters: Parameters, model: dict[str, Any], tool: Array) -> Dynamics:
    def field(name: str) -> Array:
        return np.array([value[f"{joint}.{name}"] for joint in arm.joint_names])

    older = {"friction_lead": 0.0}  # missing in older twins
    value = dict(zip(parameters.names, parameters.values.tolist(), strict=True))
    bodies = [[value[f"{link}.{x}"] for x in BODY] for link in arm.link_names]
    drive = Drive(
        **{name: field(name) for name in ("gain", *LINEAR, *SHAPE)},
        temperature=_numbers(model, "temperature"),
        health=np.ones(arm.joints),
        time_offset=float(_numbers(model, "time_offset")),
        friction_lead=float(_numbers(older | model, "friction_lead")),
    )
    inertials = [about_frame(b[0], np.array(b[1:4]), tensor(np.array(b[4:]))) for b in bodies]
    return Dynamics(arm, np.array(inertials), drive, tool)
