"""One row of a log and one row of a motion: what a live stream is made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from urdyn.signal.channels import ever_in_contact, ever_undriven
from urdyn.types import Array, Log, frozen

# What a log may hold beside the joints: the stream that it is, and the channel.
POSE = "pose"
BESIDE = {POSE: "actual_TCP_pose", "wrench": "actual_TCP_force", "raw_wrench": "ft_raw_wrench"}
# The payload as set in the controller: its mass, and its centre of mass at the flange.
SETTING = {"payload": (), "payload_cog": (3,)}
UNSET = frozen(np.full(4, np.nan))


@dataclass(frozen=True, eq=False)
class Sample:
    """One row of a log."""

    t: float  # [s]
    q: Array  # (J,) [rad]; NaN where not measured, here and below
    v: Array  # (J,) [rad/s]
    current: Array  # (J,) [A]
    temperature: Array  # (J,) [°C]
    # By stream what came since the sample before, (n, 7): stamp [s] and six numbers; a pose of the
    # controller's is followed by its joint angles, (n, 7 + J).
    beside: Mapping[str, Array] = field(default_factory=dict)
    setting: Array = field(default_factory=lambda: UNSET)  # (4,) of SETTING [kg, m]; NaN: not set
    undriven: bool = False  # a hand moves the arm, or it has no power: then it has no current
    in_contact: bool = False  # it works in contact: then neither


@dataclass(frozen=True, eq=False)
class Instant:
    """One row of a motion."""

    t: float  # [s] stamp of the current
    q: Array  # (J,) [rad], at t + offset, here and below
    v: Array  # (J,) [rad/s]
    a: Array  # (J,) [rad/s²]
    jerk: Array  # (J,) [rad/s³]
    current: Array  # (J,) [A] as measured
    temperature: Array  # (J,) [°C]
    shift: Array  # (J,) [rad] jump of the encoder's zero since the row before; mostly 0
    # (J,) [rad/s²] the acceleration, with noise other than that of `a`; None: unknown.
    instrument: Array | None = None
    instrument_jerk: Array | None = None  # (J,) [rad/s³] its slope in time

    @property
    def instrumental(self) -> Array:
        """The instrument's acceleration, (J,) [rad/s²]; `a` where it is unknown."""
        return self.a if self.instrument is None else self.instrument


def samples(log: Log) -> Iterator[Sample]:
    """The rows of a log as they came, to replay it.

    Without currents where the arm is undriven, or in contact.
    """
    names = ("actual_q", "actual_qd", "actual_current", "joint_temperatures")
    q, v, current, temperature = (log.joint(name) for name in names)
    passive, touching = ever_undriven(log), ever_in_contact(log)
    if (silent := passive | touching).any():
        current = np.where(silent[:, None], np.nan, current)
    rows = zip(q, v, current, temperature, passive.tolist(), touching.tolist(), strict=True)
    streams = {
        stream: np.column_stack([log.t, log.channels[channel], *_behind(log, stream)])
        for stream, channel in BESIDE.items()
        if channel in log and log.channels[channel].shape[1:] == (6,)
    }
    setting = _setting(log)
    return (
        Sample(
            t=float(t),
            q=q,
            v=v,
            current=amperes,
            temperature=warm,
            beside={s: told[k : k + 1] for s, told in streams.items()},
            setting=setting[k],
            undriven=led,
            in_contact=touches,
        )
        for k, (t, (q, v, amperes, warm, led, touches)) in enumerate(zip(log.t, rows, strict=True))
    )


def _setting(log: Log) -> Array:
    """The payload as set in the controller, (N, 4)."""
    columns = [
        log.channels[name]
        if name in log and log.channels[name].shape[1:] == of
        else np.full((len(log), *of), np.nan)
        for name, of in SETTING.items()
    ]
    return np.column_stack(columns)


def _behind(log: Log, stream: str) -> list[Array]:
    return [log.joint("actual_q")] if stream == POSE else []
