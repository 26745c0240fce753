"""What commissioning knows of the tracked states."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from urdyn.dbn.shown import shown_directions
from urdyn.identify.fit import Fit
from urdyn.model.population import population
from urdyn.types import Array, Gaussian

# States that the fit estimates beside the links': each joint's, with the fit's name for it.
TRACKED = {
    "f": "coulomb",
    "alpha": "viscous",
    "beta": "structural",
    "o": "offset",
    "rotor": "rotor_inertia",
}


def commissioned(
    fit: Fit, n: int, places: Mapping[str, slice], scores: Array, known: list[int]
) -> Gaussian:
    """The fit's belief in n states, given some of its parameters; 0 for states that it lacks.

    Args:
        known: indices of those parameters.
        places: of groups among the states.
        scores: (10 J, r) of m per unit of the fit's coordinates of links. The means of m and of
            skew, the error of currents' time stamps, are 0.
    """
    names, joints = list(fit.names), fit.dynamics.arm.joint_names
    links = 10 * len(joints)
    tracked = [names.index(f"{j}.{field}") for field in TRACKED.values() for j in joints]
    skew = [names.index("time_offset")] if "skew" in places and "time_offset" in names else []
    free = [*range(links), *tracked, *skew]
    T, drives = np.zeros((n, len(free))), slice(links, links + len(tracked))
    T[places["m"], :links] = scores.T
    for k, group in enumerate(TRACKED):
        columns = links + k * len(joints) + np.arange(len(joints))
        T[np.r_[places[group]], columns] = 1.0
    if skew:
        T[places["skew"], -1] = 1.0
    mean = T[:, drives] @ fit.belief.mean[tracked]
    return Gaussian(mean, T @ given(fit.belief.cov, free, known) @ T.T)


@lru_cache(maxsize=1)  # the run needs it again after its rehearsal
def shown_links(fit: Fit) -> tuple[Array, Array]:
    """What motion shows of links: m per unit of the fit's coordinates, inertials per unit of m."""
    arms = population(fit.dynamics.arm)
    V, shown = shown_directions(arms, fit.dynamics)
    return V / arms.link_sd.ravel()[:, None], shown


def gains_of(fit: Fit) -> list[int]:
    """Indices of the drives' gains among the fit's parameters; none if they were not fitted."""
    return [k for k, name in enumerate(fit.names) if name.endswith(".gain")]


def scale_of(fit: Fit) -> list[int]:
    """Index of the best-known gain, which all weights are relative to; none if none was fitted.

    That need not be the largest: the base of an upright arm has as large a drive as the shoulder,
    but bears no weight that would reveal its gain.
    """
    variance = fit.belief.cov.diagonal()
    return sorted(gains_of(fit), key=lambda k: float(variance[k]))[:1]


def taken_for_known(fit: Fit) -> list[int]:
    """Indices of what a tracker assumes to be known: gains, and the shape of friction."""
    joints, followed = fit.dynamics.arm.joint_names, TRACKED.values()
    parts = [name.rpartition(".") for name in fit.names]
    return [k for k, (j, _, what) in enumerate(parts) if j in joints and what not in followed]


def given(cov: Array, free: list[int], fixed: list[int]) -> Array:
    """Covariance of `free` given `fixed`, which may be empty."""
    cross = cov[np.ix_(free, fixed)]
    explained = np.linalg.solve(cov[np.ix_(fixed, fixed)], cross.T)
    return np.asarray(cov[np.ix_(free, free)] - cross @ explained)
