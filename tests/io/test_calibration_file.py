"""The ROS driver's calibration file: what is written reads back, and nonsense is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from urdyn.errors import InputError
from urdyn.io.calibration_file import calibration_text, read_calibration
from urdyn.types import Array


def frames(seed: int) -> Array:
    rng = np.random.default_rng(seed)
    out = np.tile(np.eye(4), (6, 1, 1))
    out[:, :3, :3] = Rotation.random(6, rng=rng).as_matrix()
    out[:, :3, 3] = rng.uniform(-1.0, 1.0, (6, 3))
    return out


@pytest.mark.parametrize("seed", range(5))
def test_what_is_written_reads_back(tmp_path: Path, seed: int) -> None:
    path, told = tmp_path / "kinematics.yaml", frames(seed)
    path.write_text(calibration_text(told, "from a test\nof two lines"))
    np.testing.assert_allclose(read_calibration(path), told, atol=1e-12)


def test_euler_angles_of_pi_turn_by_nothing(tmp_path: Path) -> None:
    path = tmp_path / "kinematics.yaml"
    text = calibration_text(np.tile(np.eye(4), (6, 1, 1)))
    for angle in ("roll", "pitch", "yaw"):
        text = text.replace(f"{angle}: 0.0", f"{angle}: {np.pi!r}")
    path.write_text(text)
    np.testing.assert_allclose(read_calibration(path), np.tile(np.eye(4), (6, 1, 1)), atol=1e-12)


def test_small_numbers_are_numbers_to_yaml(tmp_path: Path) -> None:
    path, told = tmp_path / "kinematics.yaml", np.tile(np.eye(4), (6, 1, 1))
    told[:, 0, 3] = 1e-05
    text = calibration_text(told)
    assert "1.0e-05" in text
    path.write_text(text.replace("1.0e-05", "1e-05"))  # to YAML a word
    np.testing.assert_allclose(read_calibration(path), told, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no map called 'kinematics'"),
        ("kinematics: 3", "no map called 'kinematics'"),
        ("a: [1, 2", "is not YAML"),
        ("kinematics:\n  shoulder: {x: 0}", "y of shoulder is None"),
        ("!!python/object/apply:os.getcwd []", "is not YAML"),
    ],
)
def test_nonsense_is_refused_in_a_line(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "kinematics.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        read_calibration(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("told", "named"),
    [(".nan", "nan"), ("true", "True"), ("near", "'near'"), ("9" * 400, "9" * 20)],
)
def test_a_number_that_is_none_is_named(tmp_path: Path, told: str, named: str) -> None:
    path = tmp_path / "kinematics.yaml"
    lines = calibration_text(frames(0)).splitlines()
    lines[2] = f"    x: {told}"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=f"x of shoulder is {named}, not a finite"):
        read_calibration(path)
