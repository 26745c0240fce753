"""What a browser is told, and what it shows."""

from __future__ import annotations

import socket
import time
from dataclasses import replace
from threading import Thread

import numpy as np
import pytest
from browser import CHROMIUM, DEADLINE, browser

pytest.importorskip("viser")

from urdyn.view.film import Film
from urdyn.view.paint import LESS, LINES, MORE, PAINTS, SAME, UNKNOWN
from urdyn.view.panel import lines, numbers
from urdyn.view.scene import Scene, quaternion
from urdyn.view.shapes import shapes
from urdyn.view.show import play, watch
from urdyn.view.stage import open_stage

POSE = np.array([0.3, -1.4, 1.2, -0.8, -1.2, 0.4])


@pytest.fixture(scope="module")
def scene(ur5e) -> Scene:
    return Scene(ur5e, ur5e, shapes(ur5e))


@pytest.fixture(scope="module")
def shown() -> Film:
    """An arm that stands: its elbow has half as much friction again, of its wrist none is known."""
    t = np.linspace(0.0, 60.0, 300)
    still = np.zeros((300, 6))
    friction, torque = still.copy(), still.copy()
    friction[:, 2], friction[:, 5], torque[:, 0] = 50.0, np.nan, 4.0
    return Film(t, still + POSE, still, friction, still, torque)


@pytest.fixture
def stage(scene, shown):
    found = open_stage(scene, "an <arm>", shown, "127.0.0.1", 18080)
    yield found
    found.close()


def test_a_browser_is_told_where_every_link_is(stage, scene, shown):
    stage.show(shown.moment(0))
    for handle, shape in zip(stage.links, scene.shapes, strict=True):
        pose = scene.arm.pose(POSE, shape.link)
        np.testing.assert_allclose(handle.position, pose[:3, 3], atol=1e-12)
        np.testing.assert_allclose(handle.wxyz, quaternion(pose), atol=1e-12)


def test_links_have_the_colour_of_the_joint_that_moves_them(stage, scene, shown):
    stage.show(shown.moment(0))
    told = {shape.joint: tuple(h.color) for h, shape in zip(stage.links, scene.shapes, strict=True)}
    assert told[2] == tuple(MORE.astype(int)) and told[5] == UNKNOWN
    assert told[1] == PAINTS["friction"].colour(0.0)
    stage.panel.controls["paint"].value = "health"
    assert stage.colours(shown.moment(0), stage.panel.asked().paint)[3] == told[1]


def test_a_line_of_a_joint_is_no_colour_of_the_scale():
    scale = {tuple(end.astype(int)) for end in (LESS, SAME, MORE)} | {UNKNOWN}
    told = {tuple(bytes.fromhex(colour[1:])) for colour in LINES}
    assert len(told) == 6 and not told & scale


def test_the_camera_sees_the_whole_arm_however_narrow_its_window(stage, scene):
    camera = stage.server.initial_camera
    at, to = np.array(camera.position), np.array(camera.look_at)
    along = (to - at) / np.linalg.norm(to - at)
    tool = scene.arm.pose(POSE)[:3, 3]
    for point in (np.zeros(3), tool, *(scene.arm.pose(POSE, s.link)[:3, 3] for s in scene.shapes)):
        away = point - at
        beside = np.degrees(np.arccos(away @ along / np.linalg.norm(away)))
        assert beside < 28.0  # half of what a window sees that is .7 as wide as tall


def test_only_torques_that_are_there_have_an_arrow(stage, shown):
    stage.show(shown.moment(0))
    assert stage.arrows.visible and stage.arrows.points.shape == (1, 2, 3)
    stage.panel.controls["arrows"].value = False
    stage.show(shown.moment(0))
    assert not stage.arrows.visible


def test_a_ghost_comes_when_it_is_asked_for(stage, shown):
    stage.show(shown.moment(0))
    assert not any(ghost.visible for ghost in stage.ghosts)
    stage.panel.controls["ghost"].value = True
    stage.show(shown.moment(0))
    assert all(ghost.visible for ghost in stage.ghosts)
    for ghost, link in zip(stage.ghosts, stage.links, strict=True):  # it is as it should be
        np.testing.assert_allclose(ghost.position, link.position, atol=1e-12)


def test_numbers_stand_beside_and_what_is_unknown_is_a_dash(scene, shown):
    table = numbers(scene.arm.joint_names, shown.moment(0))
    assert "+50.0 %" in table and "+4.0 N·m" in table and "–" in table


def test_a_line_is_held_where_nothing_is_known(shown):
    torque = shown.torque.copy()
    torque[:3, 1], torque[3:, 1], torque[10:20, 1], torque[0, 2] = np.nan, 1.0, np.nan, np.nan
    t, *drawn = lines(replace(shown, torque=torque), "torque")
    assert np.isfinite(drawn).all() and len(t) == 300
    np.testing.assert_array_equal(drawn[1], np.where(np.arange(300) < 3, 0.0, 1.0))


def test_nothing_is_drawn_where_nothing_is_known(shown):
    _, *drawn = lines(replace(shown, torque=np.full_like(shown.torque, np.nan)), "torque")
    assert len(drawn) == 6 and np.isnan(drawn).all()


def test_a_film_goes_on_by_itself_and_from_where_its_slider_is_put(stage, shown):
    times, time = [], stage.panel.controls["time"]

    def going() -> bool:
        times.append(time.value)
        if len(times) == 5:
            time.value = 30.0
        if len(times) == 10:
            stage.panel.controls["play"].value = False
        return len(times) < 15

    play(stage, shown, going)
    assert 0.0 < times[4] < 10.0
    assert 30.0 <= times[6] < 40.0
    assert len(set(times[11:])) == 1


def test_a_robot_is_watched_to_its_end(stage, shown):
    moments = [shown.moment(k) for k in range(8)]
    watch(stage, moments)
    assert len(stage.panel.plots["torque"].data[0]) > 1


def test_nobody_else_on_the_network_is_listened_to(stage):
    port = stage.server.get_port()
    assert stage.address == f"http://127.0.0.1:{port}"
    here = socket.gethostbyname(socket.gethostname())
    if here.startswith("127."):
        pytest.skip("this computer knows itself by loopback only")
    with socket.socket() as other, pytest.raises(OSError):
        other.settimeout(1.0)
        other.connect((here, port))


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_a_browser_shows_the_arm_in_its_colours(stage, shown, tmp_path):
    imageio = pytest.importorskip("imageio.v3")
    picture, going = tmp_path / "arm.png", [True]
    still = replace(shown, t=np.linspace(0.0, 600.0, 300))
    loop = Thread(target=play, args=(stage, still, lambda: going[0]))
    loop.start()
    try:
        with browser(tmp_path / "profile") as chromium:
            chromium.open(stage.address, 900)
            deadline = time.monotonic() + DEADLINE  # its scripts draw long after it has loaded
            forearm = others = 0
            while forearm <= 800 or others <= 1500:
                assert time.monotonic() < deadline, f"not drawn: {forearm}, {others} points"
                chromium.picture(picture, x=0, y=0, width=500, height=600)
                view = imageio.imread(picture)[..., :3].astype(int)
                red, green, blue = view[..., 0], view[..., 1], view[..., 2]
                forearm = np.sum((red > green + 40) & (green > blue))  # vermilion
                others = np.sum((np.ptp(view, axis=2) < 20) & (red < 225))  # grey as the floor
    finally:
        going[0] = False
        loop.join()
    # What the viewer's own library warns of is its own.
    assert not [c for c in chromium.complaints if '"error"' in c or '"exceptionDetails"' in c]
