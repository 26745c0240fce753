"""An endpoint that Prometheus scrapes; base units, as its naming asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.util import find_spec

from urdyn.errors import InputError, MissingExtraError
from urdyn.io.address import joined, parse
from urdyn.io.ros2.status import Status
from urdyn.io.snapshot import Snapshot

PORT = 9464
# Quantity of a joint -> name, what it is.
JOINT = {
    "coulomb": ("friction_newton_metres", "Coulomb friction"),
    "viscous": ("viscous_friction_newton_metre_seconds_per_radian", "viscous friction"),
    "structural": ("structural_damping_ratio", "loss per transmitted torque"),
    "health": ("health_ratio", "drive health, 1 when commissioned"),
    "offset": ("offset_newton_metres", "torque offset"),
    "zero": ("zero_offset_radians", "deviation of the joint's zero"),
}

Tell = Callable[[Snapshot, Sequence[Status]], None]


def serve(text: str) -> tuple[Tell, Callable[[], None]]:
    """Serve at PORT or HOST:PORT: what takes the newest snapshot, and what ends it."""
    if find_spec("prometheus_client") is None:
        raise MissingExtraError("plants", "prometheus-client")
    from prometheus_client import CollectorRegistry, Gauge, start_http_server

    host, port = parse(text, PORT, "Prometheus at")
    registry = CollectorRegistry()

    def gauge(name: str, told: str, *labels: str) -> Gauge:
        return Gauge(f"urdyn_{name}", told, ("robot", *labels), registry=registry)

    joints = {
        quantity: (
            gauge(f"joint_{name}", told, "joint"),
            gauge(f"joint_{name}_sd", f"standard deviation of {told}", "joint"),
        )
        for quantity, (name, told) in JOINT.items()
    }
    residual = gauge("joint_residual_torque_newton_metres", "measured less predicted", "joint")
    status = gauge("status", "0 OK, 1 WARN, 2 ERROR, 3 STALE", "part")
    mass = gauge("payload_mass_kilograms", "payload")
    mass_sd = gauge("payload_mass_kilograms_sd", "standard deviation of the payload")
    samples = gauge("samples", "samples taken in")
    try:
        server, thread = start_http_server(port, host, registry=registry)
    except OSError as error:
        at, told = joined(host, port), error.strerror or error
        raise InputError(f"Prometheus at {at}: {told}") from error

    def tell(now: Snapshot, statuses: Sequence[Status]) -> None:
        for joint, torque in zip(now.joints, now.residual.tolist(), strict=True):
            for quantity, (value, spread) in joints.items():
                value.labels(now.robot, joint).set(now.mean[joint][quantity])
                spread.labels(now.robot, joint).set(now.sd[joint][quantity])
            residual.labels(now.robot, joint).set(torque)
        for line in statuses:
            status.labels(now.robot, line.name.removeprefix("urdyn: ")).set(int(line.level))
        mass.labels(now.robot).set(now.mean["payload"]["mass"])
        mass_sd.labels(now.robot).set(now.sd["payload"]["mass"])
        samples.labels(now.robot).set(now.samples)

    def close() -> None:
        server.shutdown()
        server.server_close()
        thread.join(timeout=5)

    return tell, close
