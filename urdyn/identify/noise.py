"""The noise of measured current about the model: scale, colour and tails, per joint."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import repeat

import numpy as np

from urdyn.identify.slow import MEMORY, density, forgotten, periodogram, share_of, without_slow
from urdyn.types import MAD_TO_SD, Array, Mask, freeze

MAX_ORDER = 8
ENOUGH = 10 * MAX_ORDER  # rows, from which a joint's noise is learnt
BEHIND = 5 * MAX_ORDER  # rows, from which a regression can be estimated
GAUSSIAN = 100.0  # degrees of freedom from which on Student's t counts as Gaussian
MIN_DOF = 4.0
CERTAIN = 1e18  # degrees of freedom at which it is Gaussian to the last digit
TINY = 1e-6  # of a variance: no noise is predicted better
SETTLED = 400  # rows after which an innovation's effect on the noise has decayed
PIECE = 0.03  # [s] for which mispredicted friction at a reversal stays similar
WILD = 12.0  # [sd] at which residuals are clipped, so that outliers do not widen the noise


@dataclass(frozen=True, eq=False)
class Noise:
    """Autoregressive noise with Student-t innovations, plus slow noise.

    e = slow + n,    n_t = sum_k ar[k-1] n_{t-k} + w_t,    w_t ~ scale t(dof)

    The slow part decorrelates within about a second. It is a small share of the variance but most
    of what disturbs slow motion, and no regression over a few samples can represent it.
    """

    sd: Array  # (J,) [A] of e, the whole disturbance
    scale: Array  # (J,) [A] of w
    dof: Array  # (J,) [-]
    ar: Array  # (J, p) [-]
    slow: Array = field(default_factory=lambda: np.zeros(0))  # (J,) [A] sd; 0 by default
    keep: float = 0.0  # [-] autocorrelation of the slow part after one sample
    # (J,) [-] factor on w's scale near reversals of the joint; 1 by default.
    turning: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not self.slow.size:
            object.__setattr__(self, "slow", np.zeros_like(self.sd))
        if not self.turning.size:
            object.__setattr__(self, "turning", np.ones_like(self.sd))
        freeze(self, "sd", "scale", "dof", "ar", "slow", "turning")

    @property
    def each(self) -> list[Noise]:
        """That of each joint, (J,), in rows as far apart."""
        names, joints = ("sd", "scale", "dof", "ar", "slow", "turning"), range(len(self.sd))
        return [replace(self, **{x: getattr(self, x)[j : j + 1] for x in names}) for j in joints]

    @property
    def power(self) -> Array:
        """Variance of w, (J,) [A²]."""
        return np.asarray(self.scale**2 * self.dof / (self.dof - 2.0))

    @property
    def step(self) -> float:
        """Time between rows of the data it was fitted to [s]; infinite where that is unknown."""
        return -MEMORY * float(np.log(self.keep)) if self.keep else np.inf

    @property
    def gentle(self) -> Array:
        """Density of the noise at frequencies as low as its slow part's, (J,) [A²] per sample."""
        lasting = 0.5 * self.slow**2 * (1.0 + self.keep) / (1.0 - self.keep)
        return np.asarray(self.power / (1.0 - self.ar.sum(axis=1)) ** 2 + lasting)

    def autocovariance(self, lags: int, period: float) -> Array:
        """Autocovariance of the fast part at lags 0 .. `lags` rows, (lags + 1, J) [A²].

        Args:
            period: [s] between rows; where that is shorter than `step`, `step` is used.
        """
        apart = max(1, round(period / self.step))
        response = np.zeros((SETTLED + apart * lags, len(self.ar)))
        response[0] = 1.0
        for t in range(1, len(response)):
            past = response[max(0, t - self.ar.shape[1]) : t][::-1]
            response[t] = np.einsum("jk,kj->j", self.ar[:, : len(past)], past)
        each = [response[k:] * response[: len(response) - k] for k in apart * np.arange(lags + 1)]
        return np.array([products.sum(axis=0) for products in each]) * self.power

    def at(self, step: float) -> Noise:
        """The same noise in rows `step` [s] apart; itself for closer ones, where it is unknown."""
        if step < 1.5 * self.step:
            return self
        alike = regressed(self.autocovariance(MAX_ORDER, step), self.slow, step)
        return replace(alike, sd=self.sd, turning=self.turning)

    @property
    def counted(self) -> Noise:
        """Gaussian noise of the same colour that leaves as much information. [Lange1989]_"""
        scale = self.scale * np.sqrt((self.dof + 3.0) / (self.dof + 1.0))
        return replace(self, scale=scale, dof=np.full_like(self.dof, CERTAIN))

    def whiten(self, x: Array, joint: int) -> Array:
        """Whitened rows (N - p, ...) from the rows (N, ...) of a run."""
        ar, scale = self.ar[joint], np.sqrt(self.power[joint])
        seen = self.slow[joint] * (1.0 - ar.sum()) / scale
        return without_slow(whiten(x, ar), seen, self.keep)

    def weights(self, innovation: Array, joint: int, turning: Mask | bool = False) -> Array:
        """Square roots of the weights with which least squares maximises the t likelihood, (N,).

        An outlier's weight falls as 1/w²; the factor (dof+1)/(dof+3) turns the average weight into
        Fisher's information, so that covariances are not too small. [Lange1989]_

        Args:
            turning: whether the joint reverses near a row, (N,) or for all.
        """
        dof = self.dof[joint]
        scale = self.scale[joint] * np.where(turning, self.turning[joint], 1.0)
        weight = (dof + 1.0) / (dof + (innovation / scale) ** 2)
        return np.asarray(np.sqrt(weight * (dof + 1.0) / (dof + 3.0)) / scale)


def regressed(quick: Array, slow: Array, step: float) -> Noise:
    """Gaussian noise in rows `step` [s] apart, as of sums of several innovations.

    Args:
        quick: autocovariance of its fast part, (lags + 1, J) [A²].
        slow: sd of its slow part, (J,) [A].
    """
    ar, left = zip(*(_autoregressions(of_joint)[-1] for of_joint in quick.T), strict=True)
    dof = np.full_like(slow, GAUSSIAN)
    scale = np.sqrt(np.array(left) * (dof - 2.0) / dof)
    return Noise(np.hypot(np.sqrt(quick[0]), slow), scale, dof, np.array(ar), slow, forgotten(step))


def white_noise(
    residuals: list[list[Array]],
    step: float,
    usual: Noise,
    turning: list[list[Mask]] | None = None,
) -> Noise:
    """White Gaussian noise with the residuals' power, by joint; arguments as for `fit_noise`."""
    turning = turning or _nowhere(residuals)
    calm = [_calmed(*pair) for pair in zip(residuals, turning, strict=True)]
    fits = [
        _white(left) if _told(left) else own for left, own in zip(calm, usual.each, strict=True)
    ]
    return replace(_joined(fits, residuals, turning, step), keep=usual.keep)


def fit_noise(
    residuals: list[list[Array]],
    step: float,
    usual: Noise,
    absorbed: list[list[Array]] | None = None,
    turning: list[list[Mask]] | None = None,
) -> Noise:
    """Noise of every joint from its residuals, by joint and stretch [A].

    A fit absorbs the noise that its parameters can explain, slow noise most of all. How much
    follows from its own covariance: with that added, residuals have the noise's power, as in
    restricted maximum likelihood [Patterson1971]_.

    Args:
        step: time between rows [s].
        usual: of such an arm, for joints with too few residuals.
        absorbed: periodogram of what a fit absorbed, by stretch [A²]; None: nothing.
        turning: rows near reversals, whose noise is scaled separately; None: it is not.
    """
    turning = turning or _nowhere(residuals)
    if absorbed is None:
        absorbed = [[np.zeros(len(r) // 2 + 1) for r in stretches] for stretches in residuals]
    calm = [_calmed(*pair) for pair in zip(residuals, turning, strict=True)]
    keep = forgotten(step)
    fits = [
        _fit_joint(left, powers, keep) if _told(left) else own
        for left, powers, own in zip(calm, absorbed, usual.each, strict=True)
    ]
    return replace(_joined(fits, residuals, turning, step), keep=keep)


def _joined(
    fits: list[Noise], residuals: list[list[Array]], turning: list[list[Mask]], step: float
) -> Noise:
    """Noise of all joints from each one's away from reversals, with its scale near these."""
    width = max(noise.ar.shape[1] for noise in fits)
    rows = max(round(PIECE / step), 1)
    return Noise(
        sd=np.concatenate([n.sd for n in fits]),
        scale=np.concatenate([n.scale for n in fits]),
        dof=np.concatenate([n.dof for n in fits]),
        ar=np.concatenate([np.pad(n.ar, ((0, 0), (0, width - n.ar.shape[1]))) for n in fits]),
        slow=np.concatenate([n.slow for n in fits]),
        turning=np.array(list(map(_louder, fits, residuals, turning, repeat(rows)))),
    )


def _nowhere(residuals: list[list[Array]]) -> list[list[Mask]]:
    """A mask of no row of the residuals."""
    return [[np.zeros(len(r), bool) for r in stretches] for stretches in residuals]


def whiten(x: Array, ar: Array) -> Array:
    """x_t - sum_k ar[k-1] x_{t-k} along the first axis, without the first len(ar) rows."""
    from scipy.signal import lfilter  # heavy, and needed only where noise is learnt

    order = len(ar)
    return np.asarray(lfilter([1.0, *-ar], [1.0], x, axis=0))[order:] if len(x) > order else x[:0]


def _white(stretches: list[Array]) -> Noise:
    """White noise of one joint."""
    sd = np.full(1, _sd(stretches))
    return Noise(sd, sd, np.full(1, GAUSSIAN), np.zeros((1, 0)))


def _sd(stretches: list[Array]) -> float:
    """Standard deviation of all residuals."""
    return float(np.std(np.concatenate(stretches)))


def _told(stretches: list[Array]) -> bool:
    """Whether there are enough residuals to tell their noise."""
    return sum(map(len, stretches)) >= ENOUGH


def _robust_sd(residuals: Array) -> float:
    """Sd of a Gaussian with this median absolute value; next to 0 for all zeros."""
    return MAD_TO_SD * float(np.median(np.abs(residuals))) + 1e-12


def _fit_joint(stretches: list[Array], absorbed: list[Array], keep: float) -> Noise:
    """Noise of one joint."""
    count, lags = sum(len(r) for r in stretches), _lags_with_data(stretches)
    if not lags:
        return _white(stretches)
    most = WILD * _robust_sd(np.concatenate(stretches))
    stretches = [np.clip(r, -most, most) for r in stretches]
    pairs = [pair for pair in zip(stretches, absorbed, strict=True) if len(pair[0])]
    more = np.sum([_products(power, len(r), lags) for r, power in pairs], axis=0) / count
    acf = more + np.sum([_lagged(r, lags) for r, _ in pairs], axis=0) / count
    one, gaussian = np.ones(1), np.full(1, GAUSSIAN)
    sd = np.hypot(_sd(stretches), np.sqrt(more[0])) * one

    def with_slow(share: float) -> list[tuple[Array, float]]:
        """Regressions of the rest of the noise, by order."""
        return _autoregressions(acf - share * acf[0] * keep ** np.arange(lags + 1))

    w, seen, hidden = map(np.concatenate, zip(*(_spectra(*pair) for pair in pairs), strict=True))
    share = share_of(w, seen + hidden, with_slow, keep)
    ar, left = _likeliest(with_slow(share), count)
    slow = np.sqrt(share * acf[0]) * one
    unseen = left * float(np.mean(hidden / density(w, ar, left, share * acf[0], keep)))
    noise = Noise(sd, np.sqrt(left) * one, gaussian, ar[None], slow, keep)
    innovation = np.concatenate([noise.whiten(r, 0) for r in stretches if len(r) > len(ar)])
    dof = _degrees_of_freedom(innovation)
    power = float(np.mean(innovation**2)) + unseen
    scale = np.sqrt(power * (dof - 2.0) / dof)
    return replace(noise, scale=scale * one, dof=dof * one)


def _calmed(stretches: list[Array], turning: list[Mask]) -> list[Array]:
    """Residuals scaled to have no more power near reversals than elsewhere."""
    e, near = np.concatenate([*stretches, [0.0]]), np.concatenate([*turning, [False]])
    calm = float(np.mean(e[~near] ** 2))
    if not near.any() or not calm:
        return stretches
    louder = np.sqrt(max(float(np.mean(e[near] ** 2)) / calm, 1.0))
    pairs = zip(stretches, turning, strict=True)
    return [np.where(near, r / louder, r) for r, near in pairs]


def _louder(noise: Noise, stretches: list[Array], turning: list[Mask], rows: int) -> float:
    """Factor on the scale of one joint's noise near its reversals, at least 1.

    Mispredicted friction stays similar there for some tens of milliseconds. Its effect on a fit
    depends on its sum over `rows` rows, not on its size: a faster recording has more rows of the
    same error, and would otherwise be surer.
    """
    order, squares = noise.ar.shape[1], []
    for r, near in zip(stretches, turning, strict=True):
        if len(r) <= order + rows or not near.any():
            continue
        w = np.clip(noise.whiten(r, 0) / np.sqrt(noise.power[0]), -WILD, WILD)
        pieces = len(w) // rows
        whole = near[order:][: pieces * rows].reshape(pieces, rows).all(axis=1)
        sums = w[: pieces * rows].reshape(pieces, rows).sum(axis=1)
        squares.append(sums[whole] ** 2 / rows)
    told = np.concatenate([*squares, np.zeros(0)])
    return float(np.sqrt(max(np.mean(told), 1.0))) if len(told) else 1.0


def _lags_with_data(stretches: list[Array]) -> int:
    """Number of lags, up to MAX_ORDER, for which these stretches have enough rows."""
    behind = [sum(max(len(r) - k, 0) for r in stretches) for k in range(1, MAX_ORDER + 1)]
    return sum(rows >= BEHIND for rows in behind)


def _spectra(stretch: Array, absorbed: Array) -> tuple[Array, Array, Array]:
    """Frequencies except 0 [rad per sample], and the power of both there."""
    w = 2.0 * np.pi * np.asarray(np.fft.rfftfreq(len(stretch)), dtype=np.float64)
    return w[1:], periodogram(stretch)[1:], absorbed[1:]


def _lagged(stretch: Array, lags: int) -> Array:
    """Sums of lagged products, by lag, (lags + 1,); 0 beyond its length."""
    n = len(stretch)
    return np.array([stretch[min(k, n) :] @ stretch[: max(n - k, 0)] for k in range(lags + 1)])


def _products(power: Array, n: int, lags: int) -> Array:
    """The same, (lags + 1,), from a stretch's periodogram and length."""
    sums = n * np.fft.irfft(power, n)[: lags + 1]
    return np.pad(sums, (0, lags + 1 - len(sums)))


def _autoregressions(acf: Array) -> list[tuple[Array, float]]:
    """Yule-Walker coefficients of every order, and the variance of w with each [Brockwell1991]_.

    Orders end where the process would be unstable.
    """
    ar, left = np.zeros(0), float(acf[0])
    found, least = [(ar, left)], TINY * left
    for order in range(1, len(acf)):
        partial = float(acf[order] - acf[1:order] @ ar[::-1]) / left  # autocorrelation
        if abs(partial) >= 1.0:
            break
        ar = np.append(ar - partial * ar[::-1], partial)
        left *= 1.0 - partial**2
        found.append((ar, max(left, least)))
    return found


def _likeliest(regressions: list[tuple[Array, float]], n: int) -> tuple[Array, float]:
    """The regression that Akaike's criterion prefers."""
    return min(regressions, key=lambda one: n * np.log(one[1]) + 2 * len(one[0]))


def _degrees_of_freedom(innovation: Array) -> float:
    """Student's degrees of freedom from the kurtosis, 6 / (dof - 4) in excess of a Gaussian's."""
    most = WILD * _robust_sd(innovation)
    clipped = np.clip(innovation, -most, most)
    clipped = clipped - clipped.mean()
    excess = float(np.mean(clipped**4) / np.mean(clipped**2) ** 2) - 3.0
    insignificant = 2.0 * np.sqrt(24.0 / len(innovation))
    if excess < insignificant:
        return GAUSSIAN
    return float(np.clip(4.0 + 6.0 / excess, MIN_DOF + 0.1, GAUSSIAN))
