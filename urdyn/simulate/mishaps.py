"""Abrupt events: a payload, a push, a sensor; and a room that gets warmer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from urdyn.simulate.payload import Payload
from urdyn.simulate.schedule import Course, at_joint
from urdyn.simulate.wear import growth

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class PayloadChange:
    """The tool carries something else, unknown to the controller."""

    mass: float  # [kg]; 0: no payload
    onset: float = 0.0  # [s]
    com: Vector = (0.0, 0.0, 0.06)  # [m] in the last joint's frame

    def befall(self, course: Course) -> Course:
        """From the onset on, the payload stays."""
        carried = Payload(self.mass, np.array(self.com)).inertials() if self.mass else np.zeros(10)
        after = (course.t >= self.onset)[:, None]
        return replace(course, payload=np.where(after, carried, course.payload))


@dataclass(frozen=True)
class Collision:
    """A push on the middle of a link: half a sine over the duration."""

    link: int  # index of the link, that of its joint, from 0
    force: Vector  # [N] at the peak, in the axes of the controller's base
    onset: float = 0.0  # [s]
    duration: float = 0.2  # [s], above 0

    def befall(self, course: Course) -> Course:
        """F(t) = F sin(pi (t - onset) / duration)."""
        u = np.clip((course.t - self.onset) / self.duration, 0.0, 1.0)
        push = np.outer(np.sin(np.pi * u), [*self.force, 0.0, 0.0, 0.0])
        felt = course.push[:, self.link] + np.where((u < 1.0)[:, None], push, 0.0)
        return replace(course, push=at_joint(course.push, self.link, felt))


@dataclass(frozen=True)
class EncoderOffset:
    """The encoder's zero is off, abruptly or increasingly."""

    joint: int
    offset: float = 0.0  # [rad] at the onset
    rate: float = 0.0  # [rad/s]
    onset: float = 0.0  # [s]

    def befall(self, course: Course) -> Course:
        """k(t) = offset + rate (t - onset)."""
        since = course.t - self.onset
        off = growth("step", self.offset, since) + growth("linear", self.rate, since)
        off = course.encoder_offset[:, self.joint] + off
        return replace(course, encoder_offset=at_joint(course.encoder_offset, self.joint, off))


@dataclass(frozen=True)
class SensorFault:
    """A joint's current sensor reports something other than the current."""

    joint: int
    mode: Literal["stuck", "biased", "noisy", "dropped"]
    size: float = 1.0  # [A] bias, or standard deviation
    onset: float = 0.0  # [s]
    duration: float = np.inf  # [s]

    def befall(self, course: Course) -> Course:
        """Until onset + duration."""
        j, now = self.joint, course.t - self.onset
        ill = (now >= 0.0) & (now < self.duration)
        match self.mode:
            case "stuck":
                stuck = course.sensor_stuck[:, j] | ill
                return replace(course, sensor_stuck=at_joint(course.sensor_stuck, j, stuck))
            case "dropped":
                dropped = course.sensor_dropped[:, j] | ill
                return replace(course, sensor_dropped=at_joint(course.sensor_dropped, j, dropped))
            case "biased":
                bias = course.sensor_bias[:, j] + self.size * ill
                return replace(course, sensor_bias=at_joint(course.sensor_bias, j, bias))
            case "noisy":
                noise = np.hypot(course.sensor_noise[:, j], self.size * ill)
                return replace(course, sensor_noise=at_joint(course.sensor_noise, j, noise))


@dataclass(frozen=True)
class ThermalDrift:
    """The room gets warmer: not a fault, but looks like one."""

    rate: float  # [K/s]
    rise: float = np.inf  # [K] at most
    onset: float = 0.0  # [s]

    def befall(self, course: Course) -> Course:
        """rate (t - onset) up to the rise; both are negative for a room that cools."""
        warmer = growth("linear", self.rate, course.t - self.onset)
        ambient = np.sign(self.rate) * np.minimum(np.abs(warmer), np.abs(self.rise))
        return replace(course, ambient=course.ambient + ambient)
