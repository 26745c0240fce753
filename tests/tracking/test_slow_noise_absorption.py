"""What slow noise takes of a change, against a filter that does it."""

import numpy as np
from filterpy.kalman import KalmanFilter

from urdyn.dbn.robot_slice import COLUMN, ROWS, RobotSlice
from urdyn.identify.slow import MEMORY
from urdyn.tracking.noise.slow_noise_absorption import after_absorption, no_absorption

J, N, DT = 2, 300, 0.01


def slices(one, noise, stray):
    """Of a robot that says only how white currents see slow noise, (N, J)."""
    packed, nothing = np.zeros((N, J, len(ROWS))), np.zeros(J)
    packed[..., COLUMN["one"]] = one
    return [
        RobotSlice(DT, DT, p, nothing, nothing, nothing, noise, nothing, nothing, stray=stray)
        for p in packed
    ]


def test_innovations_of_a_change_are_its_signature():
    """A filter of slow noise alone, on the same currents with and without the change."""
    rng = np.random.default_rng(0)
    psi, one = np.sign(rng.standard_normal((N, J))), rng.uniform(0.2, 1.0, (N, J))
    seen = rng.random((N, J)) < 0.9
    currents, noise, stray = rng.standard_normal((N, J)), np.array([0.5, 2.0]), np.array([1.0, 0.3])
    absorbed, rows = no_absorption(J, 1), np.zeros((N, J))
    kept, told = np.exp(-DT / MEMORY), np.zeros((2, N, J))
    for j in range(J):
        for k, size in enumerate([0.0, 1.0]):
            oracle = KalmanFilter(dim_x=1, dim_z=1)
            oracle.P *= 0.0
            oracle.F *= kept
            oracle.Q *= (1.0 - kept**2) * stray[j] ** 2
            oracle.R *= noise[j] ** 2
            for i in range(N):
                oracle.predict()
                oracle.H = one[i, j : j + 1, None]
                y = currents[i, j] + size * psi[i, j]
                told[k, i, j] = y - one[i, j] * oracle.x[0, 0]
                oracle.update(y if seen[i, j] else None)
    for i, white in enumerate(slices(one, noise, stray)):
        row, absorbed = after_absorption(absorbed, white, psi[i][:, None], seen[i], DT)
        rows[i] = row[:, 0]
    np.testing.assert_allclose(rows, told[1] - told[0], rtol=1e-9, atol=1e-9)


def test_what_lasts_is_taken_and_what_turns_is_not():
    """Signatures of currents that turn within a tenth of slow noise's memory stay what they are."""
    t = np.arange(N) * DT
    psi = np.stack([np.ones(N), np.sign(np.sin(20.0 * np.pi * t / MEMORY))], axis=-1)
    absorbed, left = no_absorption(J, 1), np.zeros((N, J))
    for i, white in enumerate(slices(np.ones((N, J)), np.ones(J), np.ones(J))):
        row, absorbed = after_absorption(
            absorbed, white, psi[i][:, None], np.ones(J, dtype=bool), DT
        )
        left[i] = row[:, 0]
    last = np.mean(left[N // 2 :] ** 2, axis=0)
    assert last[0] < 0.5 * last[1]
