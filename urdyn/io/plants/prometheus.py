"""An endpoint that Prometheus scrapes; base units, as its naming rules ask."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec

from urdyn.errors import InputError, MissingExtraError
from urdyn.io.address import joined, parse
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Status

PORT = 9464
# Quantity of a joint -> name and description of its gauge.
JOINT = {
    "friction": ("friction_newton_metres", "friction when sliding at 0.5 rad/s"),
    "coulomb": ("coulomb_friction_newton_metres", "Coulomb friction"),
    "viscous": ("viscous_friction_newton_metre_seconds_per_radian", "viscous friction"),
    "structural": ("structural_damping_ratio", "loss per transmitted torque"),
    "health": ("health_ratio", "drive health, 1 when commissioned"),
    "offset": ("offset_newton_metres", "torque offset"),
    "zero": ("zero_offset_radians", "deviation of the joint's zero"),
}


class Endpoint:
    """Gauges and the server that shows them: a `Listener`."""

    def __init__(self, host: str, port: int) -> None:
        """Serve at once; OSError where that fails."""
        from prometheus_client import CollectorRegistry, Gauge, start_http_server

        registry = CollectorRegistry()

        def gauge(name: str, told: str, *labels: str) -> Gauge:
            return Gauge(f"urdyn_{name}", told, ("robot", *labels), registry=registry)

        self._joints = {
            quantity: (
                gauge(f"joint_{name}", told, "joint"),
                gauge(f"joint_{name}_sd", f"standard deviation of {told}", "joint"),
            )
            for quantity, (name, told) in JOINT.items()
        }
        residual = "joint_residual_torque_newton_metres"
        self._residual = gauge(residual, "measured less predicted", "joint")
        self._status = gauge("status", "0 OK, 1 WARN, 2 ERROR, 3 STALE", "part")
        self._mass = gauge("payload_mass_kilograms", "payload")
        self._mass_sd = gauge("payload_mass_kilograms_sd", "standard deviation of the payload")
        self._samples = gauge("samples", "samples taken in")
        self._delay = gauge("delay_seconds", "from the newest sample's arrival to its processing")
        self._server, self._thread = start_http_server(port, host, registry=registry)

    def tell(self, now: Snapshot, statuses: Sequence[Status]) -> None:
        """Show the newest state."""
        for joint, torque in zip(now.joints, now.residual.tolist(), strict=True):
            for quantity, (value, spread) in self._joints.items():
                value.labels(now.robot, joint).set(now.mean[joint][quantity])
                spread.labels(now.robot, joint).set(now.sd[joint][quantity])
            self._residual.labels(now.robot, joint).set(torque)
        for line in statuses:
            self._status.labels(now.robot, line.name.removeprefix("urdyn: ")).set(int(line.level))
        self._mass.labels(now.robot).set(now.mean["payload"]["mass"])
        self._mass_sd.labels(now.robot).set(now.sd["payload"]["mass"])
        self._samples.labels(now.robot).set(now.samples)
        self._delay.labels(now.robot).set(now.delay)

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(timeout=5)


def serve(text: str) -> Endpoint:
    """Serve at PORT or HOST:PORT.

    Raises:
        InputError: nothing can be served there.
    """
    if find_spec("prometheus_client") is None:
        raise MissingExtraError("plants", "prometheus-client")
    host, port = parse(text, PORT, "Prometheus at")
    try:
        return Endpoint(host, port)
    except OSError as error:
        at, told = joined(host, port), error.strerror or error
        raise InputError(f"Prometheus at {at}: {told}") from error
