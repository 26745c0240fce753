"""Moments and innovation of a weighted mixture of Gaussians."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.estimate.innovation import (
    LOG_2PI,
    Innovation,
    Rows,
    factor_of,
    innovation,
    require_finite,
    residual_of,
    whitening,
)
from urdyn.types import Array, Gaussian


def normalised(log_weight: Array) -> tuple[Array, float]:
    """Log of weights normalised to sum to one, (K,), and the log of their former sum."""
    top = float(log_weight.max())
    total = top + float(np.log(np.exp(log_weight - top).sum()))
    return log_weight - total, total


def moments(weight: Array, means: Array, cov: Array) -> Gaussian:
    """The Gaussian with the mixture's moments: (K,), (K, n), (n, n) or (1 or K, n, n)."""
    mean = weight @ means
    spread = means - mean
    if cov.ndim == 3:
        cov = cov[0] if len(cov) == 1 else np.tensordot(weight, cov, axes=1)
    return Gaussian(mean, cov + (weight[:, None] * spread).T @ spread)


def log_density(residual: Array, S: Array) -> Array:
    """Log of N(residual; 0, S) for each residual, (K, r); S is (r, r) or (1 or K, r, r)."""
    factor = factor_of(S)
    white = np.linalg.solve(factor, residual[..., None])[..., 0]
    log_det = 2.0 * np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(-1)
    value = -0.5 * ((white**2).sum(-1) + log_det + residual.shape[-1] * LOG_2PI)
    return np.asarray(value)


def mixture_innovation(
    y: Array, rows: Rows, predicted: Gaussian, log_likelihood: float
) -> Innovation:
    """Innovation of the mixture's moments, (r,), (r, r), with the mixture's own likelihood."""
    whitener, log_det = whitening(predicted.cov)
    require_finite(log_det, predicted.cov)
    residual = residual_of(y, rows, predicted.mean)
    gaussian = innovation(y, rows, residual, predicted.cov, whitener, log_det)
    return replace(gaussian, log_likelihood=log_likelihood)
