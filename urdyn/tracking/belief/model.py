"""From a commissioned fit to the model that filters run: its posterior is the twin's prior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.dbn.arguments import Held
from urdyn.dbn.compile import Patterns, coefficients, correlations
from urdyn.dbn.figure2 import figure2
from urdyn.dbn.graph import Network
from urdyn.dbn.joined import Joined
from urdyn.dbn.process import RandomWalk
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_drive import WARMTH
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.dbn.wear import Fading, Jolt, Wear
from urdyn.dbn.widening import Widening
from urdyn.identify.fit import Fit
from urdyn.identify.slow import MEMORY
from urdyn.model.population import KAPPA, KAPPA_SD
from urdyn.tracking.belief.commissioned import (
    commissioned,
    gains_of,
    given,
    scale_of,
    shown_links,
    taken_for_known,
)
from urdyn.tracking.noise.colour import SLOWEST
from urdyn.types import Array, Gaussian, Index

STRAYING = ("m", "f", "alpha", "beta", "z", "o")
SEEN = "curr"  # the observed node; motion is given
GROUPS_OF = {"p": ("payload",), "I": ("rotor",), "w": WARMTH}  # nodes not named as their group
DRIFTING = ("f", "z")  # groups with a rate: what wears; alpha follows f
ZERO_SD = 3e-4  # [rad] of a joint's zero on the first day
ZERO_MEMORY = 600.0  # [s] in which the belief in an unobserved zero returns to the nominal one
HEALTH_SD = 0.01  # [-] of health on the first day, relative to the commissioned gains
GAIN_SD = 1e-3  # [-] of gains that are known
SKEW_SD = 1.3e-3  # [s] of currents' time stamps, where a twin does not say how well it knows them
# sd of how a healthy arm's friction changed since commissioning: logarithms, offsets in Coulomb
# frictions. A run that started from commissioning's own belief would take that wear for noise.
DAY = {"f": 0.03, "alpha": 0.075, "beta": 0.05, "o": 0.025}
# sd of sudden damage, in logarithms: half of the friction, a tenth of a drive's health.
JOLTS = {"f": 0.4, "alpha": 0.4, "z": 0.1}
QUICKLY = 20.0  # [s] in which fast wear may change them by as much
STRIDE = 0.0795  # [s] in which no state moves far: the fastest, slow noise, fades in 1.2 s
PAYLOAD_SD = np.array([3.0, 0.3, 0.3, 0.3, *[0.05] * 6])  # kg, kg m, kg m²: anything or nothing
# [-] factor on the prior's sd where another payload is picked up. The evidence gives the new mean;
# widening the prior keeps its samples from counting twice, else every payload would confirm the
# drives that weighed it. The evidence says nothing of inertia.
ANYTHING = np.repeat([10.0, 1.0], [4, 6])
# kg, kg m, kg m²: a piece too light for evidence, maybe in the gripper since the last rest.
LIGHT = np.array([0.5, 0.05, 0.05, 0.05, *[0.005] * 6])
BULKY = np.where(np.arange(10) < 4, 0.0, PAYLOAD_SD)  # a piece that turned out not to be light
KAPPA_F_SD = 0.002  # [1/K] effect of warmth on f
LAG = 300.0  # [s] time constant with which the lubricant's temperature follows the joint's
UNLIKE = 0.4  # [K] sd of their difference


@dataclass(frozen=True)
class Drift:
    """How fast parameters of a healthy arm stray; per √s, relative where states are logarithms."""

    friction: float = 2e-4  # [1/√s] 1.2 % in an hour, of f, and of alpha beyond what follows f
    damping: float | None = None  # [1/√s] of alpha; None: as f
    bodies: float = 0.0  # [1/√s] of the links' standard scores: metal does not change
    warmth: float = 1e-3  # [1/√s] 6 % in an hour, of alpha besides, without a measured temperature
    structural: float = 2e-4  # [1/√s] 1.2 % in an hour
    health: float = 3e-5  # [1/√s] 0.2 % in an hour
    offset: float = 2e-4  # [1/√s] 1.2 % of the Coulomb friction in an hour
    zero: float = 0.01  # [rad] in the long run: an encoder that slipped, or a knock
    zero_memory: float = ZERO_MEMORY  # [s]
    zero_walk: float = 0.0  # [rad/√s] random walk of zeros, besides
    rate_sd: float = 1e-5  # [1/s] sd of the rates on the first day: 3.6 % an hour
    acceleration: float = 1e-7  # [1/s/√s] diffusion of a rate: by 2 % an hour, in an hour


def tracking_model(
    fit: Fit,
    drift: Drift | None = None,
    network: Network | None = None,
    beside: Sequence[RandomWalk] = (),
) -> Joined[RobotSlice]:
    """Observation and process of the arm that was commissioned by `fit`.

    States: k, skew, m, payload, f, alpha, beta, rotor, z, gain, o, effects of warmth, slow noise,
    states `beside` these that affect no current, and the rates of f and z. The prior is conditional
    on what is assumed known, and health is relative to the commissioned gains. Errors of the gains
    show in the payload: of all gains but the best known, as an unweighed piece reveals only their
    ratios. The edges of `network`, figure2() by default, couple the states that stray, to which m
    belongs only by `drift.bodies`. A node without an edge to SEEN is not learnt from currents: it
    stays as commissioned, but for what other edges tell of it.
    """
    network = network or figure2()
    currents = RobotCurrents(fit.dynamics, shown_links(fit)[1], _noise(fit))
    prior = _prior(fit, currents)
    if hidden := [at for name in network.hidden(SEEN) for at in _of_node(currents, name)]:
        values = np.full(len(prior.mean), np.nan)
        for at in hidden:
            values[at] = prior.mean[at]
        currents, prior = replace(currents, held=Held(values)), _apart(prior, hidden)
    process = _process(fit, currents, prior, drift or Drift(), network, beside)
    return Joined(Widening(process, _at(currents, "payload"), ANYTHING * PAYLOAD_SD), currents)


def _noise(fit: Fit) -> Array:
    """Total noise of the currents, of any colour, (J,) [A] sd."""
    return np.sqrt(fit.noise.power)


def _prior(fit: Fit, currents: RobotCurrents) -> Gaussian:
    """The fit's belief in the filter's states, (n,), as it is on another day."""
    known = _known(fit, currents, taken_for_known(fit))
    mean, whole = np.array(known.mean), np.array(known.cov)
    # Where a log showed the effect of warmth, the model has it already, as `thermal`.
    unknown = fit.dynamics.drive.thermal == 0.0
    mean[currents.places["kappa"]] = np.where(unknown, KAPPA, 0.0)
    spread: dict[str, float | Array] = {
        "k": ZERO_SD,
        "z": HEALTH_SD,
        "gain": GAIN_SD,
        "payload": PAYLOAD_SD,
        "kappa": KAPPA_SD,
        "kappa_f": KAPPA_F_SD,
        "lubricant": UNLIKE,
        "slow": np.fmax(fit.noise.slow, SLOWEST * currents.noise),
    }
    if "time_offset" not in fit.names:
        spread["skew"] = SKEW_SD
    for group, sd in spread.items():
        at = _at(currents, group)
        whole[at, at] = np.broadcast_to(sd, at.shape) ** 2
    for group, sd in DAY.items():
        at, one = _at(currents, group), fit.dynamics.drive.coulomb if group == "o" else 1.0
        whole[at, at] += (sd * one) ** 2
    if gains := gains_of(fit):
        at = _at(currents, "gain")
        whole[np.ix_(at, at)] += given(fit.belief.cov, gains, scale_of(fit))
    return Gaussian(mean, whole)


def _known(fit: Fit, currents: RobotCurrents, taken: list[int]) -> Gaussian:
    """The fit's belief in states, given those of its parameters that are assumed known."""
    return commissioned(fit, len(currents.names), currents.places, shown_links(fit)[0], taken)


def by_taken(fit: Fit, currents: RobotCurrents) -> Array:
    """Covariance of states due to what is assumed known, (p, p): gains, and the shape of friction.

    A filter compares with the commissioned arm and takes these as exact, but its estimates are no
    better known than they are: without this, a joint with an uncertain Stribeck term would be
    tracked too surely.
    """
    nothing, taken = (_known(fit, currents, at).cov for at in ([], taken_for_known(fit)))
    return np.asarray(nothing - taken)


def _at(currents: RobotCurrents, group: str) -> Index:
    place = currents.places[group]
    return np.arange(place.start, place.stop)


def _of_node(currents: RobotCurrents, name: str) -> list[Index]:
    """States of a network's node, group by group."""
    return [_at(currents, group) for group in GROUPS_OF.get(name, (name,))]


def _apart(belief: Gaussian, groups: Sequence[Index]) -> Gaussian:
    """The belief with each of these groups uncorrelated with everything else.

    Commissioning learnt the correlation from currents, which tell nothing of these groups here.
    """
    cov = np.array(belief.cov)
    for at in groups:
        cov[at], cov[:, at] = 0.0, 0.0
        cov[np.ix_(at, at)] = belief.cov[np.ix_(at, at)]
    return Gaussian(belief.mean, cov)


def _process(
    fit: Fit,
    currents: RobotCurrents,
    prior: Gaussian,
    drift: Drift,
    network: Network,
    beside: Sequence[RandomWalk],
) -> Wear:
    names, at = (*currents.names, *(name for of in beside for name in of.names)), currents.places
    p, besides = len(names), slice(len(currents.names), len(names))
    drifting = np.concatenate([_at(currents, group) for group in DRIFTING])
    one = np.ones(len(drifting))
    few, patterns = {name: at[name] for name in STRAYING}, patterns_of(currents)
    correlation = correlations(network, few, patterns, p)
    within = correlation[np.ix_(drifting, drifting)]
    sd = np.zeros(p)
    for group, values in straying(fit, drift).items():
        sd[at[group]] = values
    sd[besides] = np.concatenate([*(of.diffusion for of in beside), []])
    warmth = np.zeros(p)
    warmth[at["alpha"]] = drift.warmth
    rates = Gaussian(0.0 * one, drift.rate_sd**2 * within)
    return Wear(
        parameters=names,
        prior=_independent(prior, *(of.prior for of in beside), rates),
        own=correlation * np.outer(sd, sd),
        drifting=drifting,
        push=drift.acceleration**2 * within,
        lead=coefficients(network, few, patterns, p),
        warmth=warmth,
        fading=(
            Fading(at["lubricant"], LAG, UNLIKE),
            Fading(at["k"], drift.zero_memory, drift.zero),
        ),
        jolts=tuple(Jolt(at[group], sd, sd / QUICKLY) for group, sd in JOLTS.items()),
        payload=at["payload"],
        slow=at["slow"],
        beside=besides,
        memory=MEMORY,
    )


def _independent(*beliefs: Gaussian) -> Gaussian:
    """The joint belief of mutually independent ones."""
    mean = np.concatenate([of.mean for of in beliefs])
    cov, first = np.zeros((len(mean),) * 2), 0
    for of in beliefs:
        at = slice(first, first + len(of.mean))
        cov[at, at], first = of.cov, at.stop
    return Gaussian(mean, cov)


def straying(fit: Fit, drift: Drift) -> dict[str, float | Array]:
    """Diffusion of each group's own part."""
    return {
        "m": drift.bodies,
        "f": drift.friction,
        "alpha": drift.friction if drift.damping is None else drift.damping,
        "beta": drift.structural,
        "z": drift.health,
        "o": drift.offset * fit.dynamics.drive.coulomb,
        "k": drift.zero_walk,
    }


def patterns_of(currents: RobotCurrents) -> Patterns:
    """Which parts of a parent lead which parts of a child, where not joint by joint.

    m -> alpha: a joint's damping follows the mass that it carries, relative to the nominal one.
    """
    J = currents.reference.arm.joints
    carried = np.cumsum(currents.reference.inertials[::-1, 0])[::-1]
    masses = np.cumsum(currents.shown[::10][::-1], axis=0)[::-1]
    return {("m", "alpha"): masses[:J] / carried[:, None]}
