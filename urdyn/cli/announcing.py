"""What a run's options ask it to publish, and what it hands over to a controller at the end."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from urdyn.errors import InputError

if TYPE_CHECKING:
    import urdyn as ud
    from urdyn.io.listener import Listener
    from urdyn.io.ros2.talk import Voice
    from urdyn.tracking.output.progress import RunProgress, Watch

PUBLISHED = ("feed_forward", "friction_scales")
HANDED = ("urdf", "payload")

Final = Mapping[str, Mapping[str, Any]]  # by quantity: its mean and sd


def known(asked: Collection[str] | None, words: Collection[str], option: str) -> None:
    """BadParameter at a word that is not among `words`."""
    for word in asked or ():
        if word not in words:
            raise typer.BadParameter(f"{option} {word!r}: choose from {', '.join(words)}")


@contextmanager
def announcing(
    fit: ud.Fit,
    source: str,
    serial: str,
    prometheus: str | None,
    mqtt: str | None,
    publish: Sequence[str],
) -> Iterator[Watch | None]:
    """A watcher that publishes as asked; None where nothing is."""
    live = source.startswith("ros2://")
    if publish and not live:
        raise typer.BadParameter(f"--publish {publish[0]}: there is no ROS in {source}")
    if not live and prometheus is None and mqtt is None:
        yield None
        return
    if not serial.isprintable():
        raise InputError(f"--serial {serial!r}: is to be of signs that can be printed")
    if mqtt is not None and not serial:  # two arms of a type would take turns under its name
        raise InputError("--mqtt: topics are urdyn/SERIAL/...; say which arm it is by --serial")
    from urdyn.tracking.output.announce import Announcer, Audience

    with ExitStack() as ends:
        plants = _plants(serial, prometheus, mqtt, ends)
        voice, acknowledgements = _ros(publish) if live else (None, lambda: iter(()))
        announcer = Announcer(fit, Audience(voice, plants, acknowledgements), serial)
        ends.callback(announcer.close)
        yield announcer.watch


def both(one: Watch | None, other: Watch | None) -> Watch | None:
    """A watcher that is both, or the one that there is."""
    if one is None or other is None:
        return one or other

    def watch(glance: RunProgress) -> None:
        one(glance)
        other(glance)

    return watch


def hand(fit: ud.Fit, summary: dict[str, Any], asked: Collection[str], out: Path) -> list[Path]:
    """Write the tracked model in the forms that a controller was promised; returns the files."""
    from urdyn.io import write_text

    makers = {"urdf": ("current.urdf", _urdf), "payload": ("payload.script", _payload)}
    written = []
    for word in asked:
        name, make = makers[word]
        (out / name).unlink(missing_ok=True)  # of the run before, and out of date
        write_text(out / name, make(fit, summary))
        written.append(out / name)
    return written


def _plants(
    serial: str, prometheus: str | None, mqtt: str | None, ends: ExitStack
) -> list[Listener]:
    plants: list[Listener] = []
    if prometheus is not None:
        from urdyn.io.plants.prometheus import serve

        plants.append(ends.enter_context(closing(serve(prometheus))))
    if mqtt is not None:
        from urdyn.io.plants.mqtt import connect

        plants.append(ends.enter_context(closing(connect(mqtt, serial))))
    return plants


def _ros(publish: Collection[str]) -> tuple[Voice, Callable[[], Iterator[str]]]:
    from urdyn.io.ros2.domain import participant
    from urdyn.io.ros2.talk import Voice, dds_acknowledgements, dds_publish, dds_types

    at = participant()
    wanted = {word: word in publish for word in PUBLISHED}
    return Voice(dds_types(), dds_publish(at), **wanted), dds_acknowledgements(at)


def _urdf(fit: ud.Fit, summary: Mapping[str, Any]) -> str:
    """The bare arm with its links' masses; `payload` has what it carries."""
    from urdyn.model.describe import describe

    final: Final = summary["final"]
    arm = fit.dynamics.arm
    inertials = np.array(fit.dynamics.inertials)
    mass = np.array([final[f"{link}.mass"]["mean"] for link in arm.link_names])
    # A heavier link is taken to be denser throughout: its shape was not seen to change.
    return describe(arm, inertials * (mass / inertials[:, 0])[:, None], "urdyn: as tracked")


def _payload(fit: ud.Fit, summary: Mapping[str, Any]) -> str:
    """`set_payload` of URScript: mass [kg], centre of mass at the flange [m].

    It includes the tool where that is known, else it is what is carried beside the tool. InputError
    where it is not known well enough.
    """
    from urdyn.tracking.belief.payload_setting import settable
    from urdyn.tracking.belief.physical import KNOWN, PAYLOAD
    from urdyn.tracking.output.summary import ill_sensors
    from urdyn.types import NORMAL90

    if ill := ill_sensors(summary):
        told = f"the current sensor of {' and '.join(ill)} is at fault, which looks like a load"
        raise InputError(f"--hand-over payload: {told}; repair it and track again")
    final: Final = summary["final"]
    load, sd = [final[f"payload.{name}"]["mean"] for name in PAYLOAD], final["payload.mass"]["sd"]
    told = f"± {NORMAL90 * sd:.2f} kg (90 %)"
    if sd > KNOWN:
        told = f"{load[0]:.2f} {told} may be carried, which is nothing to set a payload by"
        raise InputError(f"--hand-over payload: {told}; track while the arm moves with its load")
    mass, com = settable(np.array(load))
    centre = ", ".join(f"{x:.5f}" for x in com)
    tool = "with the tool" if fit.tool_known else "beside the tool of the commissioning"
    beside = f"{told}, {tool}"
    return f"set_payload({mass:.4f}, [{centre}])  # {beside}\n"
