"""The browser's side: a scene, its colours and its arrows, by viser."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from importlib.util import find_spec
from io import StringIO
from typing import Any

import numpy as np

from urdyn.errors import InputError, MissingExtraError
from urdyn.io.address import door, joined
from urdyn.types import Array
from urdyn.view.film import Film, Moment
from urdyn.view.paint import BASE, PAINTS
from urdyn.view.panel import Panel, make_panel
from urdyn.view.scene import Scene, quaternion

GHOST, ARROW = (60, 72, 88), (204, 121, 167)
HAZE = 0.4  # [-] opacity of a ghost
GREAT = 0.25  # [m] of an arrow that few are longer than
USUAL = 0.05  # [m/(N·m)] where no torque is known yet
HEAD = 0.04  # [m] of an arrow
LOOK = np.array([0.85, 1.0, 0.75])  # direction from the target to the camera
NARROW = np.sin(np.radians(28.0))  # [-] sine of half the angle that a camera sees beside a panel
SHELL = 0.1  # [m] of a link's shell around its origin
POSES = 60  # of a film, that the camera is to see


@dataclass(frozen=True, eq=False)
class Stage:
    """A server, and what it draws; drawn anew by `show`."""

    scene: Scene
    server: Any
    links: tuple[Any, ...]
    ghosts: tuple[Any, ...]
    arrows: Any
    panel: Panel

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        return f"http://{joined(self.server.get_host(), self.server.get_port())}"

    def show(self, moment: Moment) -> None:
        """Put everything where it is at a moment."""
        asked = self.panel.asked()
        places = self.scene.places(moment.q, moment.zero)
        colours = self.colours(moment, asked.paint)
        with self.server.atomic():
            for link, pose, colour in zip(self.links, places, colours, strict=True):
                link.wxyz, link.position = quaternion(pose), tuple(pose[:3, 3])
                if link.color != colour:
                    link.color = colour
            self._haunt(moment, asked.ghost, asked.times)
            self._point(moment, asked.arrow if asked.arrows else 0.0)

    def tell(self, moment: Moment, past: Film) -> None:
        """Put numbers and plots beside it."""
        self.panel.tell(moment, past, self.scene.apart(moment.q, moment.zero))

    def colours(self, moment: Moment, paint: str) -> list[tuple[int, int, int]]:
        """One colour per shape."""
        values: Mapping[str, Array] = {"friction": moment.friction, "health": moment.health}
        paints = [PAINTS[paint].colour(float(value)) for value in values[paint]]
        return [paints[s.joint] if s.joint >= 0 else BASE for s in self.scene.shapes]

    def close(self) -> None:
        """Stop the server."""
        with redirect_stdout(StringIO()):
            self.server.stop()

    def _point(self, moment: Moment, length: float) -> None:
        """Arrows of `length` [m/(N·m)], where they are longer than their heads."""
        points = self.scene.arrows(moment.q, moment.zero, moment.torque, length)
        long = points[np.linalg.norm(points[:, 1] - points[:, 0], axis=1) > HEAD]
        self.arrows.visible = bool(len(long))
        if len(long):
            self.arrows.points = long.astype(np.float32)

    def _haunt(self, moment: Moment, shown: bool, times: float) -> None:
        """The nominal arm, where it is asked for."""
        if shown:
            places = self.scene.ghosts(moment.q, moment.zero, times)
            for ghost, pose in zip(self.ghosts, places, strict=True):
                ghost.wxyz, ghost.position = quaternion(pose), tuple(pose[:3, 3])
        for ghost in self.ghosts:
            if ghost.visible != shown:
                ghost.visible = shown


def require() -> None:
    """MissingExtraError where the extra is not installed."""
    if find_spec("viser") is None:
        raise MissingExtraError("viewer", "viser")


def open_stage(scene: Scene, title: str, film: Film | None, host: str, port: int) -> Stage:
    """A server at host:port, or at the next port that is free; without a film it is live."""
    import viser

    try:
        # viser's own thread does not report that its server cannot start.
        door(host, 0).close()
        with redirect_stdout(StringIO()):  # its banner; the verb says where it is
            server = viser.ViserServer(host=host, port=port, verbose=False)
    except (OSError, UnicodeError) as error:
        told = getattr(error, "strerror", None) or error
        raise InputError(f"{host!r}, port {port}: cannot be listened at: {told}") from error
    _light(server, scene)
    _aim(server, scene, film)
    links = tuple(_mesh(server, f"/arm/{s.link}", s, BASE, None) for s in scene.shapes)
    ghosts = tuple(_mesh(server, f"/ghost/{s.link}", s, GHOST, HAZE) for s in scene.shapes)
    empty = np.zeros((scene.arm.joints, 2, 3), np.float32)
    arrows = server.scene.add_arrows(
        "/torque", empty, ARROW, shaft_radius=HEAD / 5, head_radius=HEAD / 2, head_length=HEAD
    )
    end = film.end if film else 0.0
    arrow = _arrow(film)
    panel = make_panel(server.gui, scene.arm.joint_names, title, end, arrow, scene.calibrated)
    return Stage(scene, server, links, ghosts, arrows, panel)


def _arrow(film: Film | None) -> float:
    """Initial length of arrows [m/(N·m)]: the long ones fit beside the arm."""
    told = np.abs(film.torque[np.isfinite(film.torque)]) if film else np.zeros(0)
    great = float(np.quantile(told, 0.99)) if len(told) else 0.0
    return float(f"{GREAT / great:.1g}") if great > 0.0 else USUAL


def _mesh(server: Any, name: str, shape: Any, colour: Any, opacity: float | None) -> Any:
    return server.scene.add_mesh_simple(
        name,
        shape.vertices.astype(np.float32),
        shape.faces.astype(np.uint32),
        color=colour,
        opacity=opacity,
        # Only the far side of a ghost is drawn: where it stands in the arm, the arm hides it.
        side="front" if opacity is None else "back",
        visible=opacity is None,
        cast_shadow=opacity is None,
    )


def _light(server: Any, scene: Scene) -> None:
    """A floor and a light; nothing from other hosts."""
    reach = _reach(scene)
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+z")
    server.scene.configure_environment_map(None)
    server.scene.add_light_hemisphere("/sky", intensity=1.0)
    server.scene.add_grid("/floor", width=2.4 * reach, height=2.4 * reach)


def _aim(server: Any, scene: Scene, film: Film | None) -> None:
    """A camera that sees the whole arm: all that it does in a film, or may do."""
    middle, radius = ball(scene, film)
    way = LOOK / np.linalg.norm(LOOK)
    server.initial_camera.position = tuple(middle + way * radius / NARROW)
    server.initial_camera.look_at = tuple(middle)


def ball(scene: Scene, film: Film | None) -> tuple[Array, float]:
    """Middle (3,) and radius [m] of a ball with the arm in it, from base to tool."""
    known = film.q[np.isfinite(film.q).all(axis=1)] if film else np.zeros((0, 0))
    if not len(known):
        reach = _reach(scene)
        return np.array([0.0, 0.0, 0.28 * reach]), reach
    rows = np.linspace(0, len(known) - 1, POSES).round().astype(int)
    places = np.concatenate([_places(scene, q) for q in known[rows]])
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    return middle, float(np.linalg.norm(places - middle, axis=1).max()) + SHELL


def _reach(scene: Scene) -> float:
    """Reach of the arm [m]: from origin to origin of its links."""
    steps = np.diff(_places(scene, np.zeros(scene.nominal.joints)), axis=0)
    return float(np.linalg.norm(steps, axis=1).sum())


def _places(scene: Scene, q: Array) -> Array:
    """Positions of the base, the links' origins and the tool, (J + 2, 3) [m]."""
    arm = scene.nominal
    links = [arm.pose(q, link)[:3, 3] for link in arm.link_names]
    return np.stack([np.zeros(3), *links, arm.pose(q)[:3, 3]])
