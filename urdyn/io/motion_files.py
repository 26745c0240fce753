"""A planned motion as files that robots take: CSV, URScript, ROS 2 JointTrajectory.

All take the motion as rows: t (N,) [s], q, v, a (N, J) [rad, rad/s, rad/s²], at rest at both ends.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from urdyn.types import Array

URSCRIPT_JOINTS = 6  # of the arms that URScript is for
FIRST_SPEED = 0.1  # [-] at which a motion is tried the first time

SCRIPT = """\
# {title}
#
# Speed. The motion may be run at any share of its speed: the path is the same, and neither
# velocity, acceleration nor torque is above its limit at any share. Watch it at {speed:g} first,
# with a hand on the stop button; then set 0.5, then 1.0, at which it takes {duration:g} s.
# The speed slider of the pendant does not slow a servoj.
#
# Before it starts, the arm moves to the first pose by movej, slowly: from where it stands that way
# must be free, which nobody but you can see.
def excitation():
  global speed = {speed:g}
  global u = 0.0
  global step = get_steptime()
  global from_q = {q0}
  global from_v = {v0}

  # On to the next pose, {knot:g} s away at full speed, by the cubic with the velocities of both
  # ends. The motion begins at rest, so it needs no other run-up.
  def to(q, v):
    while u < 1.0:
      u = u + speed * step / {knot:g}
      w = u
      if w > 1.0:
        w = 1.0
      end
      a = w * w * (3.0 - 2.0 * w)
      b = {knot:g} * w * (1.0 - w) * (1.0 - w)
      c = {knot:g} * w * w * (w - 1.0)
      g = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
      j = 0
      while j < 6:
        g[j] = from_q[j] + a * (q[j] - from_q[j]) + b * from_v[j] + c * v[j]
        j = j + 1
      end
      servoj(g, t=step, lookahead_time=0.03, gain=300)
    end
    u = u - 1.0
    from_q = q
    from_v = v
  end

  movej(from_q, a=0.5, v=0.25)
  sleep(1.0)
{calls}
  sleep(0.5)
  stopj(1.0)
end
excitation()
"""


def motion_csv(t: Array, q: Array, v: Array, a: Array) -> Iterator[str]:
    """Lines of a CSV: t, q0 ..., v0 ..., a0 ..., at every row."""
    joints = range(q.shape[1])
    names = ["t", *(f"{order}{j}" for order in "qva" for j in joints)]
    yield ",".join(names) + "\n"
    for moment, *row in zip(t, *np.hstack([q, v, a]).T, strict=True):
        yield f"{moment:.9g}," + ",".join(f"{x + 0.0:.12g}" for x in row) + "\n"


def urscript(t: Array, q: Array, v: Array, title: str) -> str:
    """A program that follows the rows, which are `t[1]` apart, by servoj."""
    assert q.shape[1] == URSCRIPT_JOINTS, "URScript is of six joints"
    knots = zip(q[1:], v[1:], strict=True)
    calls = "\n".join(f"  to({_list(angles)}, {_list(speeds)})" for angles, speeds in knots)
    return SCRIPT.format(
        title=" ".join(title.split()),
        speed=FIRST_SPEED,
        duration=t[-1],
        knot=t[1] - t[0],
        q0=_list(q[0]),
        v0=_list(v[0]),
        calls=calls,
    )


def joint_trajectory(
    t: Array, q: Array, v: Array, a: Array, joints: Sequence[str], title: str
) -> str:
    """A trajectory_msgs/JointTrajectory in YAML, as `ros2 topic pub` and `ros2 action` take it."""
    points = "".join(
        f"- positions: {_list(angles)}\n  velocities: {_list(speeds)}\n"
        f"  accelerations: {_list(changes)}\n  time_from_start: {_moment(moment)}\n"
        for moment, angles, speeds, changes in zip(t, q, v, a, strict=True)
    )
    names = ", ".join(joints)
    return (
        f"# {' '.join(title.split())}\n"
        "# trajectory_msgs/msg/JointTrajectory. Bring the arm to the first point before, and set\n"
        f"# the speed scaling to {100 * FIRST_SPEED:g} % the first time.\n"
        "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}\n"
        f"joint_names: [{names}]\npoints:\n{points}"
    )


def _list(values: Array) -> str:
    return "[" + ", ".join(f"{x + 0.0:.9f}" for x in values) + "]"


def _moment(t: float) -> str:
    sec, nanosec = divmod(round(t * 1e9), 10**9)
    return f"{{sec: {sec}, nanosec: {nanosec}}}"
