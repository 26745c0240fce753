"""Small matrices carry all that a log tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from urdyn.identify import Noise
from urdyn.identify import design as room
from urdyn.identify.compress import absorbed_periodograms, compress, residuals
from urdyn.identify.design import Block, blocks, coefficients_at, design, runs
from urdyn.identify.slow import periodogram
from urdyn.model.drive import LINEAR
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import travel
from urdyn.types import Array, Motion


@pytest.fixture(scope="module")
def noisy(point: Dynamics, motion: Motion) -> Motion:
    """The motion with noise and a few outliers in its current, and a hole; told by one window."""
    rng = np.random.default_rng(8)
    current = motion.current + 0.05 * rng.standard_t(5.0, motion.current.shape)
    current[500:520, 3] = np.nan
    own = motion.ahead(point.drive.time_offset).a
    return replace(motion, current=current, instrument=own)


def weighted(point: Dynamics, block: Block, noise: Noise, joint: int) -> Array:
    """Rows [Phi | i] through the whitening filter, over the t likelihood's scale, (N, n + 1)."""
    problem = design(point, block)
    data = np.column_stack([problem.columns(joint), block.motion.current[:, joint]])
    ar = noise.ar[joint]
    rows = []
    for run in runs(problem.known[:, joint]):
        white = lfilter([1.0, *-ar], [1.0], data[run], axis=0)[len(ar) :]
        w = (white[:, -1] - white[:, :-1] @ coefficients_at(point)[joint]) / noise.scale[joint]
        nu = noise.dof[joint]
        weight = (nu + 1) / (nu + w**2) * (nu + 1) / (nu + 3) / noise.scale[joint] ** 2
        rows.append(np.sqrt(weight)[:, None] * white)
    return np.vstack(rows)


def scaled(gram: Array, like: Array) -> Array:
    """A Gram matrix in units of the sizes of its columns."""
    size = np.sqrt(np.diag(like))
    size[size == 0.0] = 1.0
    return gram / np.outer(size, size)


@pytest.mark.parametrize("joint", range(6))
def test_the_triangle_has_the_gram_matrix_of_the_rows(
    joint: int, point: Dynamics, noisy: Motion, noise: Noise
) -> None:
    (block,) = blocks(point, noisy)
    rows = weighted(point, block, noise, joint)
    R = compress(point, noisy, noise)[joint].R
    assert R.shape[0] == R.shape[1] == rows.shape[1]
    gram = rows.T @ rows
    # QR and the sum of N products round by N eps of the columns' sizes.
    rounding = len(rows) * np.finfo(float).eps
    np.testing.assert_allclose(scaled(R.T @ R, gram), scaled(gram, gram), rtol=0, atol=rounding)


def test_many_blocks_compress_to_what_one_does(
    point: Dynamics, noisy: Motion, noise: Noise, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A coloured one spends the first rows of every block.
    white = Noise(noise.sd, noise.sd, noise.dof, noise.ar[:, :0])
    one = compress(point, noisy, white)
    monkeypatch.setattr(room, "BLOCK", 130)
    for many, alone in zip(compress(point, noisy, white), one, strict=True):
        gram = alone.R.T @ alone.R
        # Bristles round by their way over the distance, as exponents do.
        way = np.abs(travel(noisy)).sum(axis=0) / point.drive.presliding_distance
        rounding = (len(noisy) + way.max()) * np.finfo(float).eps
        np.testing.assert_allclose(
            scaled(many.R.T @ many.R, gram), scaled(gram, gram), rtol=0, atol=rounding
        )


def test_regressors_are_the_instruments_and_what_they_leave_is_the_motions(
    point: Dynamics, noisy: Motion, noise: Noise
) -> None:
    """Least squares steps from the point by Phi_z⁺ e: Phi_z of the instrument, e of the motion."""
    rng = np.random.default_rng(9)
    off, gaussian = 0.5 * rng.standard_normal(noisy.a.shape), noise.counted
    other = replace(noisy, instrument=noisy.instrument + off)
    found, (block,) = compress(point, other, gaussian), blocks(point, other)
    for joint, w in enumerate(coefficients_at(point)):
        R, own = found[joint].R, weighted(point, block, gaussian, joint)
        Z = weighted(point, block.instrumental, gaussian, joint)[:, :-1]
        e = own[:, -1] - own[:, :-1] @ w
        score = R[:, :-1].T @ (R[:, -1] - R[:, :-1] @ w)
        size = np.linalg.norm(Z, axis=0) * np.linalg.norm(e)
        assert (np.abs(score - Z.T @ e) <= 1e-9 * size).all()
        apart = np.abs(Z.T @ e - own[:, :-1].T @ e)[:-1]  # but for time, whose column is so large
        assert apart.max() > 1e-3 * size[:-1].max()


def test_least_squares_on_the_triangle_finds_the_point(point: Dynamics, motion: Motion) -> None:
    """Without noise the coefficients at the point leave nothing, whatever the weights."""
    one = np.ones(6)
    noise = Noise(one, one, 100.0 * one, np.zeros((6, 0)))
    for block, w in zip(compress(point, motion, noise), coefficients_at(point), strict=True):
        left = block.R[:, :-1] @ w - block.R[:, -1]
        assert np.linalg.norm(left) < 1e-11 * np.linalg.norm(block.R[:, -1])


def test_what_doubt_takes_from_a_residual_is_what_the_doubtful_would_change(
    point: Dynamics, noisy: Motion
) -> None:
    """A joint's viscous friction, wrong by .1 A/(rad/s), is .1 v in the current."""
    at, wrong = 10 * np.arange(point.arm.joints, 0, -1) + LINEAR.index("viscous"), 0.1
    doubt = [np.zeros((len(w),) * 2) for w in coefficients_at(point)]
    for L, k in zip(doubt, at, strict=True):
        L[k, k] = wrong
    drive = replace(point.drive, viscous=point.drive.viscous + wrong * point.drive.gain)
    other = residuals(replace(point, drive=drive), noisy)
    found = absorbed_periodograms(point, noisy, doubt)
    for joint, stretches in enumerate(residuals(point, noisy)):
        changes = [a - b for a, b in zip(stretches, other[joint], strict=True)]
        for power, change in zip(found[joint], changes, strict=True):
            np.testing.assert_allclose(power, periodogram(change), rtol=1e-6, atol=1e-12)
