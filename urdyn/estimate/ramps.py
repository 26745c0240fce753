"""Ready to use: a parameter that may begin to ramp (the paper's eq. 5 and 6) at an unknown time.

    f(t) = level + rate max(t - onset, 0),    y = f + e

Level, onset and rate are unknown. Given the onset the others are Gaussian, and Kalman's filter is
exact; the `Bank` weighs one such filter for every onset, with the rate's prior as a sum of
Gaussians. So the estimate is the posterior mean: it lags by what cannot be known yet, and no more.
After its onset the line is straight: one that may bend again needs a `Trend` with acceleration.

    found = follow_ramp(y, sigma)                       # a Track: found["f"], found["f.rate"]
    found = track(ramp_bank(sigma), ramp_model(sigma), [Tick()] * len(y), y[:, None])
"""

from __future__ import annotations

import numpy as np

from urdyn.dbn import AffineObservation, Joined, Tick, Trend, jumps
from urdyn.estimate.bank import Bank
from urdyn.estimate.protocol import Track, track
from urdyn.given import given_count, given_number, given_numbers, not_negative, positive
from urdyn.types import Array, Gaussian

VAGUE = 1e3  # [sigma] sd of an unknown level
STEEPEST = 0.5  # [sigma/step] beyond it two readings show a ramp, and any filter will do
RATES = 10  # Gaussians that make up the rate's prior, uniform up to the steepest
EXPECTED = 40.0  # [steps] until an onset, in the prior


def ramp_model(sigma: float, level: Gaussian | None = None) -> Joined[Tick]:
    """States "f" and "f.rate", f read every tick with white noise `sigma`; nothing else drifts.

    `level` is the prior of f before the first reading, (1,); by default vague about 0.
    """
    _above_none(sigma, "sigma")
    known = _unknown(sigma, 0.0) if level is None else level
    still = np.zeros(1)
    process = Trend(("f",), known, still, np.array([0]), still, still)
    reading = AffineObservation[Tick](1, lambda _: np.eye(1), np.array([[sigma**2]]))
    return Joined(process, reading)


def ramp_bank(
    sigma: float,
    direction: int = 1,
    dt: float = 1.0,
    steepest: float | None = None,
    expected: float = EXPECTED,
    names: tuple[str, ...] = ("f", "f.rate"),
    rate: str = "f.rate",
) -> Bank:
    """The filter of `ramp_model`, or of another model with a rate among the `names` of its states.

    Args:
        sigma: noise of a reading [unit].
        direction: 1 where the parameter is expected to rise (friction), -1 to fall (health), 0
            where it may do either. A ramp the other way is followed too, but later. With 0 any ramp
            is followed a little later: until its sign shows, the posterior mean is between the two,
            unbiased over both and drawn to the level on each.
        dt: between readings [s], or 1 where time counts in steps.
        steepest: rate up to which the prior is uniform [unit/s]; sigma / (2 dt) if None.
        expected: readings until an onset, in the prior; the hazard is constant.
        rate: the state that jumps at an onset.
    """
    ways = "1 for a rise, -1 for a fall, 0 for either"
    given_number(direction, "direction", ways, lambda x: np.isin(x, (-1.0, 0.0, 1.0)))
    sigma, dt = (_above_none(x, what) for x, what in ((sigma, "sigma"), (dt, "dt")))
    most = STEEPEST * sigma / dt if steepest is None else _above_none(steepest, "steepest")
    given_number(expected, "expected", "more than 1 reading, and not for ever", lambda x: x > 1.0)
    width = most / RATES
    rates = width * (np.arange(RATES) + 0.5)
    signs = np.array([1.0, -1.0] if direction == 0 else [direction])
    signed: Array = np.ravel(signs[:, None] * rates)
    # Gaussians half a spacing wide: their sum is uniform between the first and the last.
    sizes = jumps(names, [rate], signed, spread=0.5 * width)
    return Bank(sizes, hazard=1.0 / expected)


def follow_ramp(
    y: Array,
    sigma: float,
    direction: int = 1,
    level: Gaussian | None = None,
    dt: float = 1.0,
    steepest: float | None = None,
    expected: float = EXPECTED,
) -> Track:
    """A parameter that may ramp, from its noisy readings y, (N,), NaN where there is none.

    The arguments are those of `ramp_model` and `ramp_bank`, but that an unknown level is one about
    the first reading: no result depends on where the readings have their zero. Prior knowledge of
    the level and of the steepest ramp helps where ramps are slow relative to the noise; that of the
    time until an onset where it is long, for until then noise is taken for ramps as often as onsets
    are expected.
    """
    readings = given_numbers(y, "readings y")[..., None]
    bank = ramp_bank(sigma, direction, dt, steepest, expected)
    if level is None:
        level = _unknown(sigma, next(iter(readings[np.isfinite(readings)]), 0.0))
    model = ramp_model(sigma, level)
    return track(bank, model, [Tick(dt)] * len(readings), readings)


def ramp_bound(
    sigma: float,
    onset: float,
    steps: int,
    level_sd: float,
    rate_sd: float,
    rate: float = 0.0,
    onset_sd: float = 0.0,
) -> Array:
    """Posterior Cramer-Rao bound on f after readings 1 ... `steps`, as its sd, (steps,).

    For a filter that knows the onset, or, given `rate`, knows it to `onset_sd` only. Priors count
    by their variance, as if Gaussian. [VanTrees2013]_
    """
    _above_none(sigma, "sigma")
    steps = given_count(steps, "steps")
    for when_or_what, name in ((onset, "onset"), (rate, "rate")):
        given_number(when_or_what, name)
    known = {"level_sd": level_sd, "rate_sd": rate_sd, "onset_sd": onset_sd}
    takes = "a finite number, 0 or more"
    variance = np.array(
        [given_number(sd, name, takes, not_negative) ** 2 for name, sd in known.items()]
    )
    unknown = variance > 0.0
    t = np.arange(1.0, steps + 1.0)
    slope = [np.ones(steps), np.maximum(t - onset, 0.0), -rate * (t > onset)]
    G = np.stack(slope, axis=1)[:, unknown]
    told = np.cumsum(G[:, :, None] * G[:, None, :], axis=0) / sigma**2
    cov = np.linalg.inv(told + np.diag(1.0 / variance[unknown]))
    return np.asarray(np.sqrt(np.einsum("ti,tij,tj->t", G, cov, G)))


def _unknown(sigma: float, about: float) -> Gaussian:
    """Prior of a level that is not known, (1,)."""
    return Gaussian(np.array([about]), (VAGUE * sigma) ** 2 * np.eye(1))


def _above_none(value: object, what: str) -> float:
    return given_number(value, what, "a finite number above 0", positive)
