"""The bank of onsets is the dense Gaussian likelihood, and its evidence keeps its promise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.diagnose.kinds.likelihood_ratio import log_ratio
from urdyn.diagnose.kinds.rules import SlowKind
from urdyn.diagnose.kinds.suspects import Suspect, Suspects
from urdyn.diagnose.residual.gathering import none_gathered
from urdyn.diagnose.residual.moment import Pool
from urdyn.diagnose.slow.explanation import explanation, gathered, ratios
from urdyn.diagnose.slow.onsets import (
    PAUSE,
    PROGRAM,
    RECENT,
    WITHIN,
    Block,
    Straying,
    first,
    followed,
    step,
    strayed,
)

N, BLOCKS, SECONDS = 3, 7, 5.0
WALK, WINDOW = np.array([0.02, 0.01, 0.0]), np.array([0.1, 0.0, 0.05])
E = np.eye(N)[:, :2]
LEVELS = {
    "least": 0.0,
    "warning": 1.0,
    "critical": 2.0,
    "quantity": "-",
    "unit": "-",
    "advice": "-",
}


def blocks(rng: np.random.Generator, change: np.ndarray | None = None, onset: int = 0):
    """Information of blocks of a healthy arm that strays; with a step from block `onset`."""
    P = np.diag([0.3, 0.2, 0.1]) ** 2
    x = rng.multivariate_normal(np.zeros(N), P + np.diag((PROGRAM * WINDOW) ** 2))
    made, H = [], rng.standard_normal((BLOCKS, 4, N))
    for k in range(BLOCKS):
        x = x + (k > 0) * WALK * np.sqrt(SECONDS) * rng.standard_normal(N)
        truth = x + WINDOW * rng.standard_normal(N)
        if change is not None and k >= onset:
            truth = truth + E @ change
        y = H[k] @ truth + rng.standard_normal(4)
        A, b = strayed(H[k].T @ H[k], H[k].T @ y, WINDOW)
        made.append((Block(k * SECONDS, (k + 1) * SECONDS, A, b), H[k], y))
    return P, made


def banked(P, made):
    bank = first(np.zeros(N), P, E.shape[1])
    for block, _, _ in made:
        bank = step(bank, block, Straying(WALK, WINDOW), E)
    return bank


def dense(P, made, onset: float, ramp: bool):
    """C and d of a change, out of the joint Gaussian of all measurements; its onset in blocks."""
    K = len(made)
    cov = np.kron(np.ones((K, K)), P + np.diag((PROGRAM * WINDOW) ** 2))
    for k in range(K):
        for m in range(K):
            cov[k * N : k * N + N, m * N : m * N + N] += np.diag(WALK**2) * SECONDS * min(k, m)
    cov += np.kron(np.eye(K), np.diag(WINDOW**2))
    H = np.zeros((4 * K, N * K))
    for k, (_, here, _) in enumerate(made):
        H[4 * k : 4 * k + 4, N * k : N * k + N] = here
    S = H @ cov @ H.T + np.eye(4 * K)
    y = np.concatenate([row[2] for row in made])
    fine = (np.arange(K * 1000) + 0.5) / 1000.0 - onset
    grown = np.where(fine > 0.0, SECONDS * fine if ramp else 1.0, 0.0).reshape(K, -1).mean(axis=1)
    G = H @ np.vstack([E * each for each in grown])
    return G.T @ np.linalg.solve(S, G), G.T @ np.linalg.solve(S, y)


@pytest.mark.parametrize("ramp", [False, True])
def test_every_onset_is_judged_as_the_joint_gaussian_judges_it(ramp: bool) -> None:
    P, made = blocks(np.random.default_rng(0))
    bank = banked(P, made)
    np.testing.assert_array_equal(bank.onset, SECONDS * np.r_[0.0, np.arange(1.0, BLOCKS, 0.25)])
    for m, onset in enumerate(bank.onset):
        C, d = dense(P, made, onset / SECONDS, ramp)
        np.testing.assert_allclose(bank.C[int(ramp), m], C, rtol=1e-5, atol=1e-10)
        np.testing.assert_allclose(bank.d[int(ramp), m], d, rtol=1e-5, atol=1e-6)


def test_an_onset_within_a_block_is_judged_by_the_information_since_not_by_the_time() -> None:
    """Of moments of unlike motion a block keeps their sum, b, whose Gaussian has every onset."""
    rng, P = np.random.default_rng(6), np.diag([0.3, 0.2, 0.1]) ** 2
    moments = len(WITHIN)
    H = rng.standard_normal((moments, 2, N)) * np.array([3.0, 0.0, 0.1, 1.0])[:, None, None]
    truth = rng.multivariate_normal(np.zeros(N), P)
    y = H @ truth + rng.standard_normal((moments, 2))
    gathering = none_gathered(N, 1)
    for k, t in enumerate(SECONDS * np.array(WITHIN)):
        pool = Pool(H[k].T @ H[k], H[k].T @ y[k], 0.0, np.zeros((3, 1)))
        gathering = gathering.after(pool, t, t + SECONDS / moments, np.zeros((4, 1)))
    A, b = strayed(gathering.A, gathering.b, WINDOW)
    within = SECONDS * np.array(WITHIN[1:])
    block = Block(0.0, SECONDS, A, b, since=gathering.since(within) @ E)
    bank = step(first(np.zeros(N), P, E.shape[1], 0.0), block, Straying(WALK, WINDOW), E)
    var = P + np.diag(WALK**2 * SECONDS + WINDOW**2)
    rows = H.reshape(-1, N)
    S = rows.T @ (rows @ var @ rows.T + np.eye(len(rows))) @ rows
    for m in range(moments):
        G = rows.T @ ((np.arange(moments) >= m)[:, None, None] * H).reshape(-1, N) @ E
        np.testing.assert_allclose(bank.C[0, m], G.T @ np.linalg.solve(S, G), rtol=1e-6)
        np.testing.assert_allclose(bank.d[0, m], G.T @ np.linalg.solve(S, gathering.b), rtol=1e-6)


def test_evidence_against_a_healthy_arm_is_one_on_the_average() -> None:
    rng, sd = np.random.default_rng(1), np.array([0.2, 0.1])
    ratios = []
    for _ in range(400):
        bank = banked(*blocks(rng))
        ratios.append(np.exp(log_ratio(bank.C[0], bank.d[0], sd, 1)).mean())
    error = np.std(ratios) / np.sqrt(len(ratios))
    assert abs(np.mean(ratios) - 1.0) < 4.0 * error


def test_the_time_before_a_run_counts_for_as_many_blocks_as_are_promised_for_it() -> None:
    P, made = blocks(np.random.default_rng(3), change=np.array([0.3, 0.0]))
    kind = SlowKind("wear", {"f": 0.2}, least=0.0, warning=1.0, critical=2.0, sign=1)
    of = Suspects(np.array([0]), (Suspect(kind, 0, np.array([0]), np.array([0.2]), 1.0),))
    bank = banked(P, made)
    first_alone = replace(
        bank, onset=bank.onset[:1], weight=bank.weight[:1], C=bank.C[:, :1], d=bank.d[:, :1]
    )
    told = ratios(bank, of)
    [since], [before] = gathered(bank, told), gathered(bank, told, 50.0)
    [old] = gathered(first_alone, ratios(first_alone, of))
    assert np.isclose(np.exp(before), np.exp(since) + 50.0 * np.exp(old))
    assert gathered(replace(bank, oldest=False), told, 50.0) == since


WEAR = SlowKind("wear", {"f": 0.2}, least=0.0, warning=1.0, critical=2.0, sign=1)


def wearing(made, rate: float, begin: float):
    """The same blocks of an arm whose first state grows from then on [1/s]."""
    for block, here, y in made:
        grown = E @ np.array([rate * max(block.middle - begin, 0.0), 0.0])
        yield replace(block, b=block.b + block.A @ grown), here, y


def test_a_ramp_s_size_is_as_sure_as_its_rate_over_its_age() -> None:
    P, made = blocks(np.random.default_rng(4))
    bank = banked(P, wearing(made, 0.5, 10.0))
    found = explanation(bank, Suspect(WEAR, 0, np.array([0]), np.full(1, 30.0), 1.0))
    assert found.shape == "ramp" and found.rate == pytest.approx(0.5, abs=4.0 * found.rate_sd)
    age = found.size / found.rate
    assert np.isclose(bank.t - bank.onset, age).any()
    assert found.size_sd == pytest.approx(age * found.rate_sd)


def test_what_may_be_older_than_the_run_began_by_its_first_block_or_before() -> None:
    P, made = blocks(np.random.default_rng(5), change=np.array([5.0, 0.0]))
    of = Suspect(WEAR, 0, np.array([0]), np.ones(1), 1.0)
    bank = banked(P, made)
    found = explanation(bank, of)
    assert found.older and found.began[:2] == (0.0, 0.0) and 0.0 < found.began[2] < 2.0 * SECONDS
    since = explanation(replace(bank, oldest=False), of)  # looked for from there on only
    assert not since.older and since.began[1] > 0.0


def test_old_onsets_thin_out_and_none_is_forgotten() -> None:
    P, made = blocks(np.random.default_rng(2))
    bank = first(np.zeros(N), P, E.shape[1])
    for k in range(200):
        block = Block(k * SECONDS, (k + 1) * SECONDS, made[k % BLOCKS][0].A, made[k % BLOCKS][0].b)
        bank = step(bank, block, Straying(WALK, WINDOW), E)
    assert len(bank.onset) < RECENT + 16
    assert bank.weight.sum() == 200
    assert bank.onset[0] == 0.0


def test_while_an_alarm_waits_no_onset_speaks_for_another() -> None:
    P, made = blocks(np.random.default_rng(3))
    bank = first(np.zeros(N), P, E.shape[1])
    for k in range(30):
        block = Block(k * SECONDS, (k + 1) * SECONDS, made[k % BLOCKS][0].A, made[k % BLOCKS][0].b)
        bank = step(bank, block, Straying(WALK, WINDOW), E, whole=k < 29)
        if k == 28:
            assert len(bank.onset) == 1 + len(WITHIN) * 28
    assert len(bank.onset) < RECENT + 8 and bank.weight.sum() == 30


def test_what_hides_in_a_program_may_be_anything_again_in_the_next() -> None:
    """Another program puts every state off; of one in which something hid, nothing is kept."""
    x, P, hidden = np.ones(N), np.diag([0.3, 0.2, 0.1]) ** 2, np.array([0.0, 0.4, 0.0])
    nothing, begin = (np.zeros((N, N)), np.zeros(N)), 2.0 * PAUSE
    block = Block(begin, begin + SECONDS, *nothing, hidden=hidden)
    _, mean, cov = followed(0.0, x, P, block, Straying(WALK, WINDOW))
    np.testing.assert_array_equal(mean, [1.0, 0.0, 1.0])
    kept = P * np.diag([1.0, 0.0, 1.0]) + np.diag(WALK**2) * block.end
    np.testing.assert_allclose(cov, kept + PROGRAM**2 * np.diag(WINDOW**2 + hidden**2))
    again = replace(block, begin=0.5 * PAUSE, end=0.5 * PAUSE + SECONDS)
    _, mean, cov = followed(0.0, x, P, again, Straying(WALK, WINDOW))
    np.testing.assert_array_equal(mean, x)
    np.testing.assert_allclose(cov, P + np.diag(WALK**2) * again.end)
