"""The posterior Cramer-Rao bound: no filter of a model can do better [Tichavsky1998]_.

    P⁻ = F P Fᵀ + Q,    P⁻¹ = (P⁻)⁻¹ + E[Hᵀ R⁻¹ H]

P bounds the mean square error of any estimate of x_t from all readings up to t, for a transition
whose F is the same for all x, as in every process here. The expectation is over the lives of the
model, drawn or given; where H is the same for all x, it is exact, and P is Kalman's covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.innovation import Rows, factor_of, measured_rows, whitening
from urdyn.estimate.linearised import lessened, propagated
from urdyn.estimate.square_root import lower_root
from urdyn.types import Array, Gaussian, freeze, index_of

LIVES = 100  # drawn where none are given and the model is not linear


@dataclass(frozen=True, eq=False)
class Bound:
    """The least root mean square error of every state after every slice."""

    names: tuple[str, ...]  # n
    sd: Array  # (N, n)
    cov: Array  # (n, n) after the last slice

    def __post_init__(self) -> None:
        freeze(self, "sd", "cov")

    def __getitem__(self, name: str) -> Array:
        """History of one state's bound, (N,)."""
        return np.asarray(self.sd[:, index_of(name, self.names, "state")])


def posterior_bound(
    model: TwoSlice[U],
    inputs: Sequence[U],
    observations: Array | None = None,
    lives: Array | None = None,
    rng: np.random.Generator | None = None,
) -> Bound:
    """Bound of a model over its slices.

    Args:
        model: its prior, process and noise are the true ones.
        inputs: N slices.
        observations: (N, m), of which only NaN matters: what was not measured adds nothing.
        lives: true states to average over, (N, K, n); K = 1 for the bound along one history. Drawn
            from the model by `rng` if None.

    Raises:
        InputError: observations or lives do not fit the slices or states, or F depends on the
            state.
    """
    _require_fitting(model, inputs, observations, lives)
    count = LIVES if lives is None and not model.linear.all() else 1
    rng = rng or np.random.default_rng(0)
    x = _drawn(model.prior, count, rng)
    cov, found = model.prior.cov, []
    for t, u in enumerate(inputs):
        F = model.transition_jacobian(x, u)
        if F.ndim > 2:
            raise InputError("the bound needs a process whose Jacobian is one for all states")
        Q = model.transition_cov(u)
        moved = model.transition(x, u)
        x = _drawn(Gaussian(np.zeros(len(Q)), Q), count, rng) + moved if lives is None else lives[t]
        rows = slice(None) if observations is None else measured_rows(observations[t])
        cov = _informed(propagated(F, cov) + Q, _roots(model, x, u, rows))
        found.append(np.sqrt(cov.diagonal()))
    return Bound(model.names, np.reshape(found, (-1, len(model.names))), cov)


def _require_fitting(
    model: TwoSlice[U], inputs: Sequence[U], observations: Array | None, lives: Array | None
) -> None:
    """InputError where observations or lives do not fit the slices or the model's states."""
    seen = (len(inputs), *(len(model.observe_cov(u)) for u in inputs[:1]))
    count = () if lives is None else lives.shape[1:2]
    lived = (len(inputs), *(max(k, 1) for k in count), len(model.names))
    for what, given, shape in ("observations", observations, seen), ("lives", lives, lived):
        if given is not None and given.shape != shape:
            raise InputError(f"{what} have the shape {given.shape}; of this model it is {shape}")


def _drawn(belief: Gaussian, count: int, rng: np.random.Generator) -> Array:
    unit = rng.standard_normal((count, len(belief.mean)))
    return np.asarray(belief.mean + unit @ lower_root(belief.cov).T)


def _roots(model: TwoSlice[U], x: Array, u: U, rows: Rows) -> Array:
    """G with GᵀG = E[Hᵀ R⁻¹ H] over the lives x (K, n): (r or K r, n)."""
    H = model.observe_jacobian(x, u)[..., rows, :]
    R = model.observe_cov(u)[rows][:, rows]
    white = np.linalg.solve(factor_of(R), H)
    lives = len(H) if H.ndim > 2 else 1
    return np.asarray(white.reshape(-1, H.shape[-1]) / np.sqrt(lives))


def _informed(P: Array, G: Array) -> Array:
    """(P⁻¹ + GᵀG)⁻¹ without inverting P, by the smaller of two systems."""
    r, n = G.shape
    if r < n:
        GP, noise = G @ P, np.eye(r)
        W, _ = whitening(GP @ G.T + noise)
        B = W @ GP
        after = lessened(P, B.T @ B, W.T @ B, noise)
    else:
        after = np.asarray(np.linalg.solve(np.eye(n) + P @ (G.T @ G), P))
    return 0.5 * (after + after.T)
