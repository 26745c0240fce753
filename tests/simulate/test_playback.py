"""Stories of trajectory files: what is played back, and what is refused with its line."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.model.arm import load_arm
from urdyn.simulate import fourier, from_file

HEADER = "t,q0,q1,q2,q3,q4,q5\n"


@pytest.fixture
def arm():
    return load_arm("ur5e")


def save(path, t, q, header=HEADER):
    rows = "\n".join(",".join(map(repr, row)) for row in np.column_stack([t, q]).tolist())
    path.write_text(header + rows + "\n")
    return path


@pytest.mark.parametrize("header", ["", HEADER])
def test_a_file_is_played_back_at_another_rate(tmp_path, arm, header):
    made = fourier(arm, 8.0, 50.0, np.random.default_rng(0))
    played = from_file(save(tmp_path / "a.csv", made.t + 5.0, made.q, header), arm, 500.0)
    truth = made.at(played.t)
    assert played.step == pytest.approx(0.002)
    # A quintic spline errs by less than (h k w)⁶ of an amplitude: (.02 · 12 · 2π/8)⁶ < 1e-4.
    np.testing.assert_allclose(played.q, truth.q, rtol=0, atol=1e-4)
    assert not played.v[[0, -1]].round(9).any() and not played.a[[0, -1]].round(6).any()


def test_two_points_are_a_move_from_rest_to_rest(tmp_path, arm):
    q = np.array([np.zeros(6), np.full(6, 0.5)])
    played = from_file(save(tmp_path / "a.csv", [0.0, 2.0], q), arm, 100.0)
    u = played.t / 2.0
    wanted = 0.5 * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    np.testing.assert_allclose(played.q.T, np.tile(wanted, (6, 1)), rtol=0, atol=1e-12)


BAD = {
    "time does not increase": HEADER + "0,0,0,0,0,0,0\n1,0,0,0,0,0,0\n1,0,0,0,0,0,0\n",
    ":3: 6 columns; the arm needs 7": HEADER + "0,0,0,0,0,0,0\n1,0,0,0,0,0\n",
    ":2: not a number": "0,0,0,0,0,0,0\n1,0,0,x,0,0,0\n",
    ":2: a trajectory has no gaps": "0,0,0,0,0,0,0\n1,0,0,nan,0,0,0\n",
    "two points or more": HEADER,
    "wrist_2_joint at .* % of its angle limit": "0,0,0,0,0,0,0\n60,0,0,0,0,7,0\n",
    "velocity limit|acceleration limit": "0,0,0,0,0,0,0\n0.4,0,0,0,0,1,0\n",
}


@pytest.mark.parametrize("message", BAD)
def test_a_file_that_cannot_be_followed_is_refused(tmp_path, arm, message):
    path = tmp_path / "bad.csv"
    path.write_text(BAD[message])
    with pytest.raises(InputError, match=message) as refused:
        from_file(path, arm, 100.0)
    assert "bad.csv" in str(refused.value)


@pytest.mark.parametrize("rate", [4.0, 10.0, 100.0])
def test_rows_far_apart_hide_no_limit(tmp_path, arm, rate):
    path = tmp_path / "jerk.csv"
    path.write_text("0,0,0,0,0,0,0\n0.1,0.5,0,0,0,0,0\n")
    with pytest.raises(InputError, match="shoulder_pan_joint at 298 % of its velocity limit"):
        from_file(path, arm, rate)


@pytest.mark.parametrize("rate", [np.nan, 0.0, np.inf, -3.0])
def test_a_rate_that_is_none_is_refused(tmp_path, arm, rate):
    path = save(tmp_path / "a.csv", [0.0, 2.0], np.zeros((2, 6)))
    with pytest.raises(InputError, match=r"rate .*: takes a finite number of Hz, above 0"):
        from_file(path, arm, rate)


def test_a_file_that_is_not_there_is_refused(tmp_path, arm):
    with pytest.raises(InputError, match="cannot be read"):
        from_file(tmp_path / "none.csv", arm, 100.0)
