"""What is to be learnt, and what is known already: a Gaussian problem in standard scores.

    M = Lambda + sum_j rows W_jᵀ mean(phi_jᵀ phi_j) W_j / sigma_j²        [Swevers1997]_

Lambda is the prior information (of the population, or a twin), W_j = d w_j / d z the derivative of
a joint's current coefficients in the scores, sigma_j the noise of that current.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.identify.excite.columns import TERMS, Columns, columns
from urdyn.identify.excite.interest import interesting, of_payload
from urdyn.identify.fit import Fit
from urdyn.identify.map_estimate import linearised
from urdyn.identify.noise import GAUSSIAN, Noise
from urdyn.identify.typical_noise import typical_noise
from urdyn.identify.unknowns import PayloadPrior, Unknowns, unknowns_of
from urdyn.model.arm import Arm
from urdyn.model.consistency import inertials
from urdyn.model.drive import LINEAR, STEPS
from urdyn.model.dynamics import Dynamics
from urdyn.model.moments import generic_moments
from urdyn.model.population import population
from urdyn.simulate import Payload
from urdyn.types import Array, freeze

DOUBT = 1e-3  # [-] weight left to the population's prior where that is doubted
TOLD = 1e-8  # [-] of the largest eigenvalue of information: less is rounding


@dataclass(frozen=True, eq=False)
class Question:
    """An arm's unknowns, what is known of them, and the information of a row of data."""

    point: Dynamics  # where the problem is linearised, with its load
    unknowns: Unknowns
    scores: Array  # (P,) of the point
    known: Array  # (P, P) information in standard scores before the run
    noise: Noise
    rate: float  # [Hz] of the rows that count: no higher than that for which the noise is known
    weights: Array  # (J, C, P) d w_j / d z over sigma_j: for rows of unit noise
    asked: Array  # (P, r) orthonormal directions of interest, in scores

    def __post_init__(self) -> None:
        freeze(self, "scores", "known", "weights", "asked")

    def information(self, columns: Columns, rows: float) -> Array:
        """M (P, P) after `rows` rows of a motion that is sampled at N moments."""
        return np.asarray(self.known + rows * _information(self.weights, columns))

    def doubted(self) -> Question:
        """The same with next to no weight on the population's prior.

        A direction in which the prior is tighter than data can be would add nothing to the volume
        criterion, so that no motion would excite it, and it would never be learnt.
        """
        P = len(self.known)
        return replace(self, known=self.known - (1.0 - DOUBT) * np.eye(P))

    def slope(self, columns: Columns, rows: float, S: Array) -> Array:
        """d tr(S M) / d phi, (N, J, C), for a symmetric S (P, P)."""
        W = self.weights
        A = (2.0 * rows / len(columns.q)) * np.einsum("jcp,jdp->jcd", W @ S, W, optimize=True)
        return np.stack([columns.phi[:, j] @ A_j for j, A_j in enumerate(A)], axis=1)


def question(
    arm: Arm,
    payload: Payload | None = None,
    twin: Fit | None = None,
    interest: Sequence[str] = (),
    about: Dynamics | None = None,
    rate: float = np.inf,
) -> Question:
    """The question that a run of `arm` with `payload` is to answer.

    Args:
        payload: of known mass; if it is of interest itself, it is wholly unknown.
        twin: what is known already, and the noise; None: what is known of such arms, and what
            recordings show.
        interest: names of what is to be learnt; none: all that motion can show.
        about: the arm to linearise about; None: the twin's, or one typical of its type.
        rate: of the future log [Hz]; by default that of the twin's.
    """
    sought = of_payload(interest)
    loads = (PayloadPrior(None if sought else payload.mass),) if payload else ()
    if sought and not payload:
        loads = (PayloadPrior(),)
    tool = np.zeros(10) if twin is None else twin.dynamics.payload
    unknowns = _unknowns(arm, twin, loads)
    bare = about or (population(arm).typical() if twin is None else twin.dynamics)
    carried = _carried(payload, loads)
    point = replace(bare, payload=sum(carried, tool))
    noise = typical_noise(arm, 1.0 / rate) if twin is None else twin.noise.at(1.0 / rate)
    rate = min(rate, 1.0 / noise.step) if noise.keep else rate
    scores = unknowns.score(point, tuple(carried))
    W = _weights(unknowns, point, scores, 0 if loads else None, level(noise))
    asked = _asked(unknowns, point, W, interest)
    return Question(point, unknowns, scores, _known(unknowns, twin), noise, rate, W, asked)


def level(noise: Noise) -> Array:
    """White noise that gives as little information on slow motion as this noise, (J,) [A]."""
    counted = noise.counted
    scale = np.where(noise.dof < GAUSSIAN, counted.scale, noise.scale)
    return np.sqrt(replace(counted, scale=scale).gentle)


def _unknowns(arm: Arm, twin: Fit | None, loads: tuple[PayloadPrior, ...]) -> Unknowns:
    """The unknowns of an identification: those of the twin, or those that every joint has."""
    if twin is None:
        return Unknowns(population(arm), (frozenset[str](),) * arm.joints, None, loads)
    return unknowns_of(twin, loads)


def _carried(payload: Payload | None, loads: tuple[PayloadPrior, ...]) -> list[Array]:
    if payload:
        return [payload.inertials()]
    return [inertials(load.mean()) for load in loads]


def _known(unknowns: Unknowns, twin: Fit | None) -> Array:
    """Information in scores before the run: unit, or a twin's; always unit for a new payload."""
    P = len(unknowns.mean)
    known = np.eye(P)
    if twin is not None:
        names = [n for n in unknowns.names if n in twin.names and not n.startswith("payload_")]
        at, there = ([of.names.index(n) for n in names] for of in (unknowns, twin))
        cov = twin.belief.cov[np.ix_(there, there)] / np.outer(unknowns.sd[at], unknowns.sd[at])
        known[np.ix_(at, at)] = np.linalg.inv(cov)
    return known


def _weights(
    unknowns: Unknowns, point: Dynamics, z: Array, payload: int | None, sigma: Array
) -> Array:
    """W_j / sigma_j of every joint, for the columns of `Columns`, (J, C, P)."""
    joints, P = len(sigma), len(unknowns.mean)
    out = np.zeros((joints, 10 * joints + len(TERMS), P))
    _, jacobian = linearised(unknowns, [(j, payload) for j in range(joints)], point, z)
    begin = 0
    for j in range(joints):
        rigid = 10 * (joints - j)
        out[j, 10 * j : 10 * joints] = jacobian[begin : begin + rigid]
        linear = jacobian[begin + rigid :][: len(LINEAR)]
        out[j, 10 * joints :] = linear[[LINEAR.index(name) for name in TERMS]]
        begin += rigid + len(LINEAR) + len(STEPS)
    return out / sigma[:, None, None]


def _information(weights: Array, columns: Columns) -> Array:
    """Information of one row, (P, P)."""
    phi, W = columns.phi, weights
    parts = [W[j].T @ (phi[:, j].T @ phi[:, j]) @ W[j] for j in range(len(W))]
    return np.asarray(sum(parts) / len(phi))


def _asked(unknowns: Unknowns, point: Dynamics, W: Array, interest: Sequence[str]) -> Array:
    """Directions of interest: those that are named, or all that any motion can show."""
    P = len(unknowns.mean)
    if interest:
        return np.eye(P)[:, interesting(unknowns.names, interest)]
    information = _information(W, columns(point, *generic_moments(point.arm)))
    values, vectors = np.linalg.eigh(information)
    return np.asarray(vectors[:, values > TOLD * values[-1]])
