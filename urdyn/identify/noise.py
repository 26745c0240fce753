"""How measured current scatters around the model: scale, colour and tails, per joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array, frozen

MAX_ORDER = 8
GAUSSIAN = 100.0  # degrees of freedom beyond which Student's t is called Gaussian
MIN_DOF = 4.0


@dataclass(frozen=True)
class Noise:
    """Autoregressive noise with Student-t innovations.

    e_t = sum_k ar[k-1] e_{t-k} + w_t,    w_t ~ scale t(dof)
    """

    sd: Array  # (J,) [A] of e, the whole disturbance
    scale: Array  # (J,) [A] of w
    dof: Array  # (J,) [-]
    ar: Array  # (J, p) [-]

    def __post_init__(self) -> None:
        for name in ("sd", "scale", "dof", "ar"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def plain(self) -> Noise:
        """White Gaussian noise of the same power."""
        return Noise(self.sd, self.sd, np.full_like(self.dof, GAUSSIAN), self.ar[:, :0])

    def weights(self, innovation: Array, joint: int) -> Array:
        """Square roots of the weights that make least squares the t likelihood's, (N,).

        An outlier's weight falls as 1/w²; the factor (dof+1)/(dof+3) turns the average weight into
        Fisher's information, so that covariances are not too small. [Lange1989]_
        """
        dof, scale = self.dof[joint], self.scale[joint]
        weight = (dof + 1.0) / (dof + (innovation / scale) ** 2)
        return np.asarray(np.sqrt(weight * (dof + 1.0) / (dof + 3.0)) / scale)


def fit_noise(residuals: list[list[Array]]) -> Noise:
    """Noise of every joint from its residuals, joint by joint, stretch by stretch [A]."""
    fits = [_fit_joint(stretches) for stretches in residuals]
    width = max(len(ar) for _, _, _, ar in fits)
    return Noise(
        np.array([sd for sd, _, _, _ in fits]),
        np.array([scale for _, scale, _, _ in fits]),
        np.array([dof for _, _, dof, _ in fits]),
        np.array([np.pad(ar, (0, width - len(ar))) for _, _, _, ar in fits]),
    )


def whiten(x: Array, ar: Array) -> Array:
    """x_t - sum_k ar[k-1] x_{t-k} along the first axis; the first len(ar) rows are spent."""
    order = len(ar)
    white = x[order:].copy()
    for lag, coefficient in enumerate(ar, start=1):
        if coefficient:
            white -= coefficient * x[order - lag : len(x) - lag]
    return white


def _fit_joint(stretches: list[Array]) -> tuple[float, float, float, Array]:
    together = np.concatenate(stretches) if stretches else np.zeros(0)
    if len(together) < 10 * MAX_ORDER:
        return 1.0, 1.0, GAUSSIAN, np.zeros(0)
    ar = _autoregression(stretches, len(together))
    innovation = np.concatenate([whiten(r, ar) for r in stretches if len(r) > len(ar)])
    dof = _degrees_of_freedom(innovation)
    rms = float(np.sqrt(np.mean(innovation**2)))
    return float(np.std(together)), rms * np.sqrt((dof - 2.0) / dof), dof, ar


def _autoregression(stretches: list[Array], n: int) -> Array:
    """Yule-Walker coefficients, the order by Akaike's criterion."""
    from scipy.linalg import solve_toeplitz  # heavy, and only needed where noise is learned

    acf = np.array(
        [sum(r[lag:] @ r[: len(r) - lag] for r in stretches) / n for lag in range(MAX_ORDER + 1)]
    )
    best, fewest = np.zeros(0), n * np.log(acf[0])
    for order in range(1, MAX_ORDER + 1):
        ar = solve_toeplitz(acf[:order], acf[1 : order + 1])
        criterion = n * np.log(acf[0] - ar @ acf[1 : order + 1]) + 2 * order
        if criterion < fewest:
            best, fewest = ar, criterion
    return best


def _degrees_of_freedom(innovation: Array) -> float:
    """Student's degrees of freedom from the kurtosis, 6 / (dof - 4) in excess of a Gaussian's.

    Clipped at twelve sigma, so that one wild sample does not make every sample an outlier.
    """
    sigma = 1.4826 * np.median(np.abs(innovation)) + 1e-12
    clipped = np.clip(innovation, -12 * sigma, 12 * sigma)
    clipped = clipped - clipped.mean()
    excess = float(np.mean(clipped**4) / np.mean(clipped**2) ** 2) - 3.0
    insignificant = 2.0 * np.sqrt(24.0 / len(innovation))
    if excess < insignificant:
        return GAUSSIAN
    return float(np.clip(4.0 + 6.0 / excess, MIN_DOF + 0.1, GAUSSIAN))
