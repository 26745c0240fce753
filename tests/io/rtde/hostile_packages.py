"""Packages that no honest client sends."""

from __future__ import annotations

import random
import struct

from urdyn.io.rtde import events as e
from urdyn.io.rtde.fields import outputs
from urdyn.io.rtde.wire import client_wire


def mutated(rng: random.Random, sound: list[bytes]) -> bytes:
    """A package that was sound once, or never."""
    data = bytearray(rng.choice(sound) if rng.random() < 0.8 else rng.randbytes(rng.randrange(40)))
    for _ in range(rng.randrange(4)):
        place = rng.randrange(len(data) + 1)
        match rng.randrange(4):
            case 0 if data:
                data[place % len(data)] = rng.randrange(256)
            case 1:
                del data[place:]
            case 2:
                data[place:place] = rng.randbytes(rng.randrange(1, 9))
            case 3 if len(data) > 2:
                data[:2] = struct.pack(">H", len(data))
    return bytes(data)


def sound_packages(seed: int = 0) -> list[bytes]:
    """One of everything that a client says, and more recipes."""
    wire, rng = client_wire(), random.Random(seed)
    wire.version = 2
    every = sorted(outputs((5, 23)))
    return [
        wire.write(event)
        for event in (
            e.RequestVersion(2),
            e.RequestVersion(1),
            e.GetController(),
            *(e.SetupOutputs(tuple(rng.sample(every, 20)), 500.0 / n) for n in range(1, 6)),
            e.SetupOutputs(("x",) * 40, 500.0),
            e.SetupInputs(("input_int_register_24", "input_double_register_24")),
            e.SetupInputs(("speed_slider_mask",)),
            e.Data(1, bytes(12)),
            e.Data(1, b"\0\0\0\1"),
            e.Start(),
            e.Pause(),
            e.Text("hello", "me"),
        )
    ]
