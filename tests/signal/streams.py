"""Motions as streams of samples, and what the causal twin makes of them."""

from __future__ import annotations

import numpy as np

from urdyn.signal import Causal, CausalState, Instant, samples
from urdyn.types import Array, Log


def log_of(t: Array, q: Array, v: Array) -> Log:
    rng = np.random.default_rng(1)
    channels = {"actual_q": q, "actual_qd": v, "actual_current": rng.normal(size=q.shape)}
    return Log(t, channels)


def swing(t: Array, joints: int = 3, omega: float = 3.0) -> tuple[Array, Array]:
    phase = omega * t[:, None] + np.arange(joints)
    return np.sin(phase), omega * np.cos(phase)


def play(twin: Causal, log: Log) -> tuple[CausalState, list[Instant]]:
    state, out = twin.init(log.joints), []
    for sample in samples(log):
        state, instant = twin.step(state, sample)
        out += [instant] if instant else []
    return state, out


def stacked(instants: list[Instant], name: str) -> Array:
    return np.stack([getattr(instant, name) for instant in instants])
