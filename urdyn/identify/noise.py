"""How measured current scatters around the model: scale, colour and tails, per joint."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import repeat

import numpy as np

from urdyn.identify.slow import MEMORY, density, forgotten, periodogram, share_of, without_slow
from urdyn.types import MAD_TO_SD, Array, Mask, frozen

MAX_ORDER = 8
BEHIND = 5 * MAX_ORDER  # rows, that a regression is told from
GAUSSIAN = 100.0  # degrees of freedom beyond which Student's t is called Gaussian
MIN_DOF = 4.0
CERTAIN = 1e18  # degrees of freedom of what is Gaussian to the last digit
TINY = 1e-6  # of a variance: no noise is foreseen better
SETTLED = 400  # rows after which noise has forgotten an innovation
PIECE = 0.03  # [s] in which friction that is misjudged at a reversal stays alike
WILD = 12.0  # [sd] at which a residual is clipped: an outlier does not widen the noise


@dataclass(frozen=True, eq=False)
class Noise:
    """Autoregressive noise with Student-t innovations, and beside it what passes slowly.

    e = slow + n,    n_t = sum_k ar[k-1] n_{t-k} + w_t,    w_t ~ scale t(dof)

    The slow part forgets itself within a second or so. It is a small share of the variance and most
    of what disturbs slow motion, which no regression over a few samples can say.
    """

    sd: Array  # (J,) [A] of e, the whole disturbance
    scale: Array  # (J,) [A] of w
    dof: Array  # (J,) [-]
    ar: Array  # (J, p) [-]
    slow: Array = field(default_factory=lambda: np.zeros(0))  # (J,) [A] sd; by default nothing
    keep: float = 0.0  # [-] of the slow part that is left a sample on
    # (J,) [-] by how much w is louder where the joint turns round; by default no louder.
    turning: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not self.slow.size:
            object.__setattr__(self, "slow", np.zeros_like(self.sd))
        if not self.turning.size:
            object.__setattr__(self, "turning", np.ones_like(self.sd))
        for name in ("sd", "scale", "dof", "ar", "slow", "turning"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def power(self) -> Array:
        """Variance of w, (J,) [A²]."""
        return np.asarray(self.scale**2 * self.dof / (self.dof - 2.0))

    @property
    def step(self) -> float:
        """Time from row to row of what it was fitted to [s]; infinite where that is unknown."""
        return -MEMORY * float(np.log(self.keep)) if self.keep else np.inf

    @property
    def gentle(self) -> Array:
        """Density of the noise beside motion as slow as its slow part, (J,) [A²] a sample."""
        lasting = 0.5 * self.slow**2 * (1.0 + self.keep) / (1.0 - self.keep)
        return np.asarray(self.power / (1.0 - self.ar.sum(axis=1)) ** 2 + lasting)

    def autocovariance(self, lags: int, period: float) -> Array:
        """Of the quick part, 0 .. `lags` rows apart, (lags + 1, J) [A²].

        Args:
            period: [s] between rows; of those that are closer than rows were, it is as of those.
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
        """The same noise in rows `step` [s] apart; of closer rows than its own it is not known."""
        if step < 1.5 * self.step:
            return self
        alike = self.autocovariance(MAX_ORDER, step).T
        ar, left = zip(*(_autoregressions(quick)[-1] for quick in alike), strict=True)
        dof = np.full_like(self.dof, GAUSSIAN)  # of what several innovations add up to
        scale = np.sqrt(np.array(left) * (dof - 2.0) / dof)
        return replace(self, scale=scale, dof=dof, ar=np.array(ar), keep=forgotten(step))

    @property
    def counted(self) -> Noise:
        """Gaussian noise of the same colour that tells as much as this one does. [Lange1989]_"""
        scale = self.scale * np.sqrt((self.dof + 3.0) / (self.dof + 1.0))
        return replace(self, scale=scale, dof=np.full_like(self.dof, CERTAIN))

    def whiten(self, x: Array, joint: int) -> Array:
        """Rows (N - p, ...) of noise w out of the rows (N, ...) of a run."""
        ar, scale = self.ar[joint], np.sqrt(self.power[joint])
        seen = self.slow[joint] * (1.0 - ar.sum()) / scale
        return without_slow(whiten(x, ar), seen, self.keep)

    def weights(self, innovation: Array, joint: int, turning: Mask | bool = False) -> Array:
        """Square roots of the weights that make least squares the t likelihood's, (N,).

        An outlier's weight falls as 1/w²; the factor (dof+1)/(dof+3) turns the average weight into
        Fisher's information, so that covariances are not too small. [Lange1989]_

        Args:
            turning: whether the joint turns round near a row, (N,) or of all.
        """
        dof = self.dof[joint]
        scale = self.scale[joint] * np.where(turning, self.turning[joint], 1.0)
        weight = (dof + 1.0) / (dof + (innovation / scale) ** 2)
        return np.asarray(np.sqrt(weight * (dof + 1.0) / (dof + 3.0)) / scale)


def white_noise(
    residuals: list[list[Array]], step: float, turning: list[list[Mask]] | None = None
) -> Noise:
    """White Gaussian noise of the residuals' power, joint by joint; arguments as `fit_noise`'s."""
    turning = turning or _nowhere(residuals)
    fits = [_white(_calmed(*pair)) for pair in zip(residuals, turning, strict=True)]
    return _joined(fits, residuals, turning, step)


def fit_noise(
    residuals: list[list[Array]],
    step: float,
    absorbed: list[list[Array]] | None = None,
    turning: list[list[Mask]] | None = None,
) -> Noise:
    """Noise of every joint from its residuals, joint by joint, stretch by stretch [A].

    A fit takes from the noise what its parameters can explain, most of all of what is slow. Its own
    covariance tells how much: with that beside them residuals have the power that the noise had, as
    restricted maximum likelihood would have it [Patterson1971]_.

    Args:
        step: time from row to row [s].
        absorbed: periodogram of what a fit absorbed, stretch by stretch [A²]; None: nothing.
        turning: rows near where the joint turns round, whose noise is told apart; None: it is not.
    """
    turning = turning or _nowhere(residuals)
    if absorbed is None:
        absorbed = [[np.zeros(len(r) // 2 + 1) for r in stretches] for stretches in residuals]
    calm = [_calmed(*pair) for pair in zip(residuals, turning, strict=True)]
    keep = forgotten(step)
    fits = [_fit_joint(left, powers, keep) for left, powers in zip(calm, absorbed, strict=True)]
    return replace(_joined(fits, residuals, turning, step), keep=keep)


def _joined(
    fits: list[Noise], residuals: list[list[Array]], turning: list[list[Mask]], step: float
) -> Noise:
    """Noise of all joints from that of each, which is told of where they go their way."""
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
    """No row of the residuals."""
    return [[np.zeros(len(r), bool) for r in stretches] for stretches in residuals]


def whiten(x: Array, ar: Array) -> Array:
    """x_t - sum_k ar[k-1] x_{t-k} along the first axis; the first len(ar) rows are spent."""
    from scipy.signal import lfilter  # heavy, and only needed where noise is learned

    order = len(ar)
    return np.asarray(lfilter([1.0, *-ar], [1.0], x, axis=0))[order:] if len(x) > order else x[:0]


def _white(stretches: list[Array]) -> Noise:
    """White noise of one joint."""
    sd = np.full(1, _sd(stretches))
    return Noise(sd, sd, np.full(1, GAUSSIAN), np.zeros((1, 0)))


def _sd(stretches: list[Array]) -> float:
    """Of all residuals; 1 where there are too few."""
    together = np.concatenate([*stretches, np.zeros(0)])
    return float(np.std(together)) if len(together) >= 10 * MAX_ORDER else 1.0


def _robust_sd(residuals: Array) -> float:
    """Of a Gaussian with this median size; of what is always zero, next to nothing."""
    return MAD_TO_SD * float(np.median(np.abs(residuals))) + 1e-12


def _fit_joint(stretches: list[Array], absorbed: list[Array], keep: float) -> Noise:
    """Noise of one joint."""
    count, lags = sum(len(r) for r in stretches), _lags_with_data(stretches)
    if count < 10 * MAX_ORDER or not lags:
        return _white(stretches)
    most = WILD * _robust_sd(np.concatenate(stretches))
    stretches = [np.clip(r, -most, most) for r in stretches]
    pairs = [pair for pair in zip(stretches, absorbed, strict=True) if len(pair[0])]
    more = np.sum([_products(power, len(r), lags) for r, power in pairs], axis=0) / count
    acf = more + np.sum([_lagged(r, lags) for r, _ in pairs], axis=0) / count
    one, gaussian = np.ones(1), np.full(1, GAUSSIAN)
    sd = np.hypot(_sd(stretches), np.sqrt(more[0])) * one

    def with_slow(share: float) -> list[tuple[Array, float]]:
        """Regressions of what is left of the noise, by order."""
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
    """Residuals that are on average no louder near turns than where the joint goes its way."""
    e, near = np.concatenate([*stretches, [0.0]]), np.concatenate([*turning, [False]])
    calm = float(np.mean(e[~near] ** 2))
    if not near.any() or not calm:
        return stretches
    louder = np.sqrt(max(float(np.mean(e[near] ** 2)) / calm, 1.0))
    pairs = zip(stretches, turning, strict=True)
    return [np.where(near, r / louder, r) for r, near in pairs]


def _louder(noise: Noise, stretches: list[Array], turning: list[Mask], rows: int) -> float:
    """By how much one joint's noise is louder where it turns round, at least 1.

    Friction that is misjudged there is so for some tens of milliseconds alike. What that does to a
    fit is told by what it adds up to over `rows` rows, not by its size: a faster recording has more
    rows of the same error, and would else be the surer of it.
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
    """Most lags, MAX_ORDER at the most, beyond which such stretches have rows enough."""
    behind = [sum(max(len(r) - k, 0) for r in stretches) for k in range(1, MAX_ORDER + 1)]
    return sum(rows >= BEHIND for rows in behind)


def _spectra(stretch: Array, absorbed: Array) -> tuple[Array, Array, Array]:
    """Frequencies but 0 [rad] a sample, and the power of both there."""
    w = 2.0 * np.pi * np.asarray(np.fft.rfftfreq(len(stretch)), dtype=np.float64)
    return w[1:], periodogram(stretch)[1:], absorbed[1:]


def _lagged(stretch: Array, lags: int) -> Array:
    """Sums of products of neighbours, by lag, (lags + 1,); 0 beyond its length."""
    n = len(stretch)
    return np.array([stretch[min(k, n) :] @ stretch[: max(n - k, 0)] for k in range(lags + 1)])


def _products(power: Array, n: int, lags: int) -> Array:
    """The same, (lags + 1,), of a stretch of which the periodogram and the length are known."""
    sums = n * np.fft.irfft(power, n)[: lags + 1]
    return np.pad(sums, (0, lags + 1 - len(sums)))


def _autoregressions(acf: Array) -> list[tuple[Array, float]]:
    """Yule-Walker coefficients of every order, and the variance of w with each.

    Up to that from which on no noise has these products: one that grows without end would.
    """
    from scipy.linalg import solve_toeplitz  # heavy, and only needed where noise is learned

    found, least = [(np.zeros(0), float(acf[0]))], TINY * float(acf[0])
    for order in range(1, len(acf)):
        ar = solve_toeplitz(acf[:order], acf[1 : order + 1])
        if abs(ar[-1]) >= 1.0:  # a partial autocorrelation
            break
        found.append((ar, max(float(acf[0] - ar @ acf[1 : order + 1]), least)))
    return found


def _likeliest(regressions: list[tuple[Array, float]], n: int) -> tuple[Array, float]:
    """The one that Akaike's criterion prefers."""
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
