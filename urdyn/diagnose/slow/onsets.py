"""Every onset at once: what changed, when, and how, against a healthy arm's straying.

A filter follows the healthy arm: its first-day state, and its straying by the day, by the hour and
by the window. A fault that begins at tau moves the filter's innovations by a known signature;
following that signature for every tau makes the likelihood of any change quadratic [Willsky1976]_:

    log L(delta) = d' delta - delta' C delta / 2

whatever directions delta has. Steps and ramps are followed side by side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.types import Array, Index

PAUSE = 10.0  # [s] without work, after which it may be another program
PROGRAM = 1.0  # [-] of the windows' straying, by which the model may be off throughout a program
WITHIN = (0.0, 0.25, 0.5, 0.75)  # [-] of a block, points at which a change may begin
RECENT = 8 * len(WITHIN)  # onsets that are all kept; older ones are ever sparser
APART = 0.5  # [-] of an old onset's age, gap between its neighbours above which it is kept


@dataclass(frozen=True, eq=False)
class Straying:
    """How far a healthy arm strays, per state."""

    walk: Array  # (n,) [1/√s]
    window: Array  # (n,) sd from window to window: programs differ, no model is perfect


@dataclass(frozen=True, eq=False)
class Bank:
    """The healthy arm, and every onset."""

    t: float  # [s] end of the last block; NaN before the first
    middle: float  # [s] of that block, to which its means refer
    x: Array  # (n,)
    P: Array  # (n, n)
    onset: Array  # (m,) [s]
    oldest: bool  # the first onset is the first block's: a change may be older than the run
    weight: Array  # (m,) onsets that this one stands for
    X: Array  # (n, 2, m, p) how far a unit of each change has moved the filter
    C: Array  # (2, m, p, p)
    d: Array  # (2, m, p)


@dataclass(frozen=True, eq=False)
class Block:
    """Information about the states in some seconds, with the window's own straying in it."""

    begin: float  # [s]
    end: float  # [s]
    A: Array  # (n, n)
    b: Array  # (n,)
    walk: Array | float = 0.0  # (n,) [1/√s] in addition to that of every block
    hidden: Array | float = 0.0  # (n,) sd of an effect hidden in a program, which ends with it
    leap: Array | float = 0.0  # (n,) sd of a possible change at its start
    lost: Array | float = 0.0  # as `friction.lost` has it, (4, J); 0: not known
    # (k, n, p) mean shift as which a unit of each fault since each onset within it shows; None:
    # information is even over it
    since: Array | None = None
    # Where it began with another load: the block without that, or any unseen piece.
    unladen: Block | None = None

    @property
    def middle(self) -> float:
        """Its middle [s]."""
        return 0.5 * (self.begin + self.end)

    def bearing(self, more: Array, bore: bool) -> Block:
        """The block with another usual load, whose states differ by `more`, (n,).

        With that load nothing is hidden yet.

        Args:
            bore: it is this load that it began with.
        """
        if self.unladen is None:
            return self
        if bore:
            return replace(self, hidden=0.0, unladen=None)
        bare = self.unladen
        return replace(self, hidden=0.0, unladen=replace(bare, b=bare.b - bare.A @ more))


def first(x: Array, P: Array, p: int, t: float = np.nan, middle: float = np.nan) -> Bank:
    """The bank before the first block, or restarted after one with this end and middle [s]."""
    n = len(x)
    return Bank(
        t=t,
        middle=middle,
        x=x,
        P=P,
        onset=np.zeros(0),
        oldest=bool(np.isnan(t)),
        weight=np.zeros(0),
        X=np.zeros((n, 2, 0, p)),
        C=np.zeros((2, 0, p, p)),
        d=np.zeros((2, 0, p)),
    )


def strayed(A: Array, b: Array, window: Array) -> tuple[Array, Array]:
    """Information about the states from a window in which they were off by sd `window`, (n,).

    (A^-1 + W)^-1 and its vector, where A may be singular.
    """
    spread = np.linalg.inv(np.eye(len(b)) + A * window**2)
    return spread @ A, spread @ b


def step(bank: Bank, block: Block, straying: Straying, E: Array, whole: bool = False) -> Bank:
    """Process one block.

    Args:
        E: directions that faults have, (n, p).
        whole: keep every onset. After an alarm the false alarm rate is not at stake, and the onset
            that explains it must not be merged into another.
    """
    x, P, stays = _strayed(bank.t, bank.x, bank.P, block, straying)
    X = stays[:, None, None, None] * bank.X
    bank = _with_onsets(replace(bank, x=x, X=X), block, E.shape[1])
    keep = np.linalg.inv(np.eye(len(P)) + block.A @ P)  # (I + A P)^-1
    seen = keep @ block.A  # (A^-1 + P)^-1
    after = P @ keep
    P = 0.5 * (after + after.T)
    g = block.b - block.A @ bank.x
    missed = _grown(bank.onset, block, E) - bank.X  # (n, 2, m, p)
    flat = missed.reshape(len(P), -1)
    weighed = (seen @ flat).reshape(missed.shape)
    C = bank.C + np.einsum("nsmp,nsmq->smpq", missed, weighed, optimize=True)
    d = bank.d + ((keep @ g) @ flat).reshape(bank.d.shape)
    X = bank.X + ((after @ block.A) @ flat).reshape(missed.shape)
    x = bank.x + after @ g
    bank = replace(bank, t=block.end, middle=block.middle, x=x, P=P, X=X, C=C, d=d)
    return bank if whole else _thinned(bank)


def relieved(bank: Bank, states: Index, directions: Index) -> Bank:
    """Drop the evidence about some states so far: from here on they mean something else.

    Args:
        directions: of changes of those states.
    """
    X, C, d = bank.X.copy(), bank.C.copy(), bank.d.copy()
    X[states] = X[..., directions] = 0.0
    C[..., directions] = C[..., directions, :] = d[..., directions] = 0.0
    return replace(bank, X=X, C=C, d=d)


def followed(
    t: float, x: Array, P: Array, block: Block, straying: Straying
) -> tuple[float, Array, Array]:
    """The healthy arm alone, after one more block."""
    x, P, _ = _strayed(t, x, P, block, straying)
    after = P @ np.linalg.inv(np.eye(len(P)) + block.A @ P)
    return block.end, x + after @ (block.b - block.A @ x), 0.5 * (after + after.T)


def _strayed(
    t: float, x: Array, P: Array, block: Block, straying: Straying
) -> tuple[Array, Array, Array]:
    """Belief in a block after one that ended at `t`, and which states carry over, (n,)."""
    walk = straying.walk**2 + block.walk**2
    more = walk * (0.0 if np.isnan(t) else block.end - t) + np.square(block.leap)
    stays = np.ones_like(x)
    if another(t, block.begin):
        more = more + between_programs(straying.window, block.hidden) ** 2
        stays = stays * (np.asarray(block.hidden) == 0.0)  # 0 or 1
    return stays * x, stays[:, None] * P * stays + np.diag(more), stays


def another(t: float, begin: float) -> bool:
    """Whether it may be another program at `begin` than at `t` [s]; the first one is new, too."""
    return not begin - t <= PAUSE


def between_programs(window: Array, hidden: Array | float = 0.0) -> Array:
    """sd of the states' shift for as long as another program runs, (n,).

    Args:
        window: straying from window to window.
        hidden: sd of an effect hidden in a program.
    """
    return PROGRAM * np.hypot(window, hidden)


def _grown(onset: Array, block: Block, E: Array) -> Array:
    """Mean shift over a block by unit steps and ramps from each onset on, (n, 2, m, p)."""
    begin = np.maximum(onset, block.begin)
    share, age = (block.end - begin) / (block.end - block.begin), 0.5 * (begin + block.end) - onset
    step = share[:, None] * E[:, None]
    if block.since is not None:
        within = np.flatnonzero(onset > block.begin)  # none in a run's first block
        step[:, within] = np.moveaxis(block.since[: len(within)], 0, 1)
    return np.stack([step, age[:, None] * step], axis=1)


def _with_onsets(bank: Bank, block: Block, p: int) -> Bank:
    """Add the onsets of one more block; a change within a run's first may be older."""
    first_of_all = bank.oldest and not len(bank.onset)
    within = np.array(WITHIN[:1] if first_of_all else WITHIN)
    n, more = len(bank.x), len(within)
    return replace(
        bank,
        onset=np.append(bank.onset, block.begin + within * (block.end - block.begin)),
        weight=np.append(bank.weight, np.full(more, 1.0 / more)),
        X=np.concatenate([bank.X, np.zeros((n, 2, more, p))], axis=2),
        C=np.concatenate([bank.C, np.zeros((2, more, p, p))], axis=1),
        d=np.concatenate([bank.d, np.zeros((2, more, p))], axis=1),
    )


def _thinned(bank: Bank) -> Bank:
    """Drop old onsets whose neighbours are close; the older one takes over the weight."""
    m = len(bank.onset)
    if m <= RECENT + 2:
        return bank
    age = bank.t - bank.onset
    # gap between an onset's neighbours over its age: the onset with the least is dropped
    gap = (age[:-2] - age[2:]) / age[1:-1]
    k = int(np.argmin(gap[: m - RECENT - 1])) + 1
    if gap[k - 1] > APART:
        return bank
    weight = bank.weight.copy()
    weight[k - 1] += weight[k]
    keep = np.arange(m) != k
    fewer = replace(
        bank,
        onset=bank.onset[keep],
        weight=weight[keep],
        X=bank.X[:, :, keep],
        C=bank.C[:, keep],
        d=bank.d[:, keep],
    )
    return _thinned(fewer)
