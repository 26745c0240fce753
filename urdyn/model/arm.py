"""The arm: its description by a URDF, and its rigid-body dynamics by Pinocchio.

    tau = Y(q, v, a) pi        pi: the inertials of all moving links, end to end

All functions broadcast over the leading axes of q, v, a, each (..., J) [rad, rad/s, rad/s²]
(a prismatic joint: m, m/s, m/s²).
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from urdyn.errors import ArmError
from urdyn.given import given_each, given_numbers
from urdyn.model.chain import Chain, parse, read_chain, read_text
from urdyn.model.consistency import is_consistent
from urdyn.model.library import RERATED, find, names
from urdyn.types import Array, Mask, freeze, shaped

# What dynamics needs from a URDF. Geometry never reaches Pinocchio: missing meshes do not matter.
NEEDED = {
    "robot": ("link", "joint"),
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "joint": ("origin", "parent", "child", "axis", "limit"),
}
FIRST = "shoulder_pan_joint"  # by UR's naming
# What stands before a mesh's name that is relative: no path from /, no package:// and no file://.
RELATIVE = re.compile(r"""<mesh\s[^<>]*?\bfilename\s*=\s*["'](?!/|\w+://)""")


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm of J joints; not for use by two threads at once: Pinocchio's data are scratch.

    Armature and friction are not part of it: torques are those of rigid bodies alone.
    """

    name: str
    joint_names: tuple[str, ...]  # base first
    link_names: tuple[str, ...]  # the link that each joint moves
    lower: Array  # (J,) [rad]; a continuous joint has -2 pi and 2 pi
    upper: Array  # (J,) [rad]
    velocity_limit: Array  # (J,) [rad/s]; inf where the file has none, or 0
    effort_limit: Array  # (J,) [N m]; inf where the file has none, or 0
    inertials: Array  # (J, 10) m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the joint's frame
    urdf: str = field(repr=False)  # the file's text, whatever the inertials are now; meshes located
    prefix: str  # of UR's names of joints and links; "" where they are bare, or another maker's
    tool: str  # tool0, or the last moving link where there is none
    _model: Any = field(repr=False)
    _data: Any = field(repr=False)

    def __post_init__(self) -> None:
        freeze(self, "lower", "upper", "velocity_limit", "effort_limit")
        object.__setattr__(
            self, "inertials", shaped("inertials", self.inertials, (self.joints, 10))
        )

    @property
    def joints(self) -> int:
        """Number of joints J."""
        return len(self.joint_names)

    @property
    def slides(self) -> Mask:
        """Which joints are prismatic, (J,)."""
        kinds = [joint.shortname() for joint in list(self._model.joints)[1:]]
        return np.array([kind.startswith("JointModelP") for kind in kinds])

    def regressor(self, q: Array, v: Array, a: Array) -> Array:
        """Y, (..., J, 10 J): torque = Y @ inertials.ravel(), for any inertials."""
        return self._each(pin.computeJointTorqueRegressor, (self.joints, 10 * self.joints), q, v, a)

    def torque(self, q: Array, v: Array, a: Array, inertials: Array | None = None) -> Array:
        """Rigid-body torque (..., J) [N m] with these inertials (J, 10), by recursive Newton-Euler.

        None: the arm's own, which are the published ones for an arm that was loaded. With those
        that a fit found, it is `fit.dynamics.rigid.torque(q, v, a)`.
        """
        arm = self._having(inertials)
        if all(map(self._is_one, (q, v, a))):
            return arm._each(pin.rnea, (self.joints,), q, v, a)
        lead, rows = self._rows(q, v, a)
        tau = np.empty_like(rows[0])
        # On this thread, but with the loop in Pinocchio: in Python it would take as long again.
        pin.rneaInParallel(1, pin.ModelPool(arm._model, 1), *(x.T for x in (*rows, tau)))
        return tau.reshape(*lead, self.joints)

    def torque_derivatives(
        self, q: Array, v: Array, a: Array, inertials: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """d torque / dq, d torque / dv, and the mass matrix d torque / da, each (..., J, J)."""
        shape = (3, self.joints, self.joints)
        all_three = self._having(inertials)._each(pin.computeRNEADerivatives, shape, q, v, a)
        return all_three[..., 0, :, :], all_three[..., 1, :, :], all_three[..., 2, :, :]

    def wrench_regressor(self, q: Array, v: Array, a: Array) -> Array:
        """Y, (..., 6, 10): Y @ pi is the wrench that moves a body of inertials pi on the last link.

        Force and moment [N, N m] about the last joint's frame, in its axes; gravity is in it.
        """
        last = self.joints

        def derive(model: Any, data: Any, q: Array, v: Array, a: Array) -> Any:
            pin.rnea(model, data, q, v, a)
            return pin.jointBodyRegressor(model, data, last)

        return self._each(derive, (6, 10), q, v, a)

    def accelerate(self, q: Array, v: Array, tau: Array, inertials: Array | None = None) -> Array:
        """Acceleration (..., J) [rad/s²] under torque tau (..., J) [N m]: forward dynamics."""
        return self._having(inertials)._each(pin.aba, (self.joints,), q, v, tau)

    def accelerator(self, inertials: Array, armature: Array) -> Callable[..., Array]:
        """Forward dynamics of one moment, f(q, v, tau) -> a, for tight loops.

        Args:
            inertials: of the links, (J, 10).
            armature: rotor inertia reflected to each joint, (J,) [kg·m²].
        """
        model = with_inertials(self, inertials)._model
        model.armature = np.asarray(armature, dtype=np.float64)
        data = model.createData()

        def accelerate(q: Array, v: Array, tau: Array) -> Array:
            return np.asarray(pin.aba(model, data, q, v, tau))

        return accelerate

    def pose(self, q: Array, frame: str | None = None) -> Array:
        """transform_frame_to_base (..., 4, 4): `frame`, or the tool, seen from the root link."""
        index = self._frame(frame or self.tool)

        def place(model: Any, data: Any, q: Array) -> Any:
            pin.forwardKinematics(model, data, q)
            return pin.updateFramePlacement(model, data, index).homogeneous

        return self._each(place, (4, 4), q)

    def jacobian(self, q: Array, frame: str | None = None) -> Array:
        """Twist of `frame`, or the tool, per joint speed (..., 6, J): linear first, root's axes."""
        index = self._frame(frame or self.tool)

        def derive(model: Any, data: Any, q: Array) -> Any:
            J = pin.computeFrameJacobian(model, data, q, index, pin.LOCAL_WORLD_ALIGNED)
            return J.reshape(6, self.joints)  # of one joint it comes flat

        return self._each(derive, (6, self.joints), q)

    def _each(self, call: Callable[..., Any], shape: tuple[int, ...], *motion: Array) -> Array:
        """`call` at every sample of the motion, (..., *shape)."""
        if all(map(self._is_one, motion)):
            # A live stream's one sample; of one joint a matrix comes flat.
            return np.array(call(self._model, self._data, *motion)).reshape(shape)
        lead, rows = self._rows(*motion)
        out = np.empty((len(rows[0]), *shape))
        model, data = self._model, self._data
        for result, *sample in zip(out, *rows, strict=True):
            result[...] = call(model, data, *sample)
        return out.reshape(*lead, *shape)

    def _is_one(self, x: Array) -> bool:
        """Whether Pinocchio takes `x` as it is."""
        plain = type(x) is np.ndarray and x.dtype == np.float64 and x.flags.c_contiguous
        return plain and x.shape == (self.joints,)

    def _rows(self, *motion: Array) -> tuple[tuple[int, ...], list[Array]]:
        """The leading shape of `motion` and its arrays as contiguous (N, J)."""
        arrays = [given_numbers(x, "the motion") for x in motion]
        for x in arrays:
            if x.shape[-1:] != (self.joints,):
                raise ArmError(f"{self.name} has {self.joints} joints, the motion {x.shape[-1:]}")
        try:
            shape = np.broadcast_shapes(*(x.shape for x in arrays))
        except ValueError:
            told = ", ".join(str(x.shape) for x in arrays)
            raise ArmError(
                f"the parts of the motion have the shapes {told}; give all alike"
            ) from None
        rows = [np.broadcast_to(x, shape).reshape(-1, self.joints) for x in arrays]
        return shape[:-1], [np.ascontiguousarray(x) for x in rows]

    def _having(self, inertials: Array | None) -> Arm:
        """This arm, with `inertials` where they are given."""
        return self if inertials is None else with_inertials(self, inertials)

    def _frame(self, name: str) -> int:
        """Pinocchio's index of a link's frame."""
        if not self._model.existFrame(name, pin.FrameType.BODY):
            raise ArmError(f"{self.name} has no link {name!r}")
        return int(self._model.getFrameId(name, pin.FrameType.BODY))


def load_arm(robot: str | Path) -> Arm:
    """An arm of the library by its name, or any serial chain by the path of its URDF."""
    if (name := str(robot).lower()) in RERATED:
        older = load_arm(RERATED[name])
        urdf = older.urdf.replace(f'<robot name="{older.name}">', f'<robot name="{name}">')
        return replace(older, name=name, urdf=urdf)
    path = find(robot)
    try:
        return read_arm(_located(read_text(path), path.absolute().parent), path.stem)
    except ArmError as error:
        raise ArmError(f"{path}: {error}") from None


def _located(urdf: str, folder: Path) -> str:
    """The text with names of meshes that are relative to its `folder` made absolute.

    It goes into other files, in other folders: there such names would mean nothing.
    """
    home = escape(f"{folder}/")
    return RELATIVE.sub(lambda found: found[0] + home, urdf)


def described(arm: Arm) -> dict[str, str]:
    """What a file has to hold beside an arm's name: its URDF, unless that is the library's."""
    known = arm.name in names() and arm.urdf == read_text(find(arm.name))
    return {} if known else {"urdf": arm.urdf}


def read_arm(urdf: str, name: str = "arm") -> Arm:
    """The arm that a URDF's text describes; `name` where the text gives none."""
    root = parse(urdf)
    chain = read_chain(root)
    model = _build(root, chain)
    links = tuple(body[0] for body in chain.bodies)
    joints = tuple(joint.name for joint in chain.joints)
    prefix = next((name.removesuffix(FIRST) for name in joints if name.endswith(FIRST)), "")
    inertials = np.array([inertia.toDynamicParameters() for inertia in model.inertias[1:]])
    _check_bodies(links, inertials)
    return Arm(
        name=chain.name or name,
        joint_names=joints,
        link_names=links,
        lower=np.array([joint.lower for joint in chain.joints]),
        upper=np.array([joint.upper for joint in chain.joints]),
        velocity_limit=np.array([joint.velocity for joint in chain.joints]),
        effort_limit=np.array([joint.effort for joint in chain.joints]),
        inertials=inertials,
        urdf=urdf,
        prefix=prefix,
        tool=next(
            (tool for tool in (f"{prefix}tool0", "tool0") if tool in chain.frames), links[-1]
        ),
        _model=model,
        _data=model.createData(),
    )


def with_inertials(arm: Arm, inertials: Array) -> Arm:
    """`arm` with other inertials (J, 10), which need not be those of solid bodies; masses not 0."""
    model = pin.Model(arm._model)
    takes = "finite numbers, masses that are not 0; Arm.regressor takes any"
    due = given_each(inertials, "inertials", (arm.joints, 10), takes, _with_masses)
    for i, parameters in enumerate(due, start=1):
        model.inertias[i] = pin.Inertia.FromDynamicParameters(parameters)
    return replace(arm, inertials=due, _model=model, _data=model.createData())


def _with_masses(inertials: Array) -> Mask:
    """Which inertials are finite, and of a body that has a centre of mass, (J, 10)."""
    return np.asarray(np.isfinite(inertials) & (inertials[:, :1] != 0.0))


def describes_base(arm: Arm) -> bool:
    """Whether it has UR's `base`, in whose axes the controller and its pendant tell everything."""
    return bool(arm._model.existFrame(f"{arm.prefix}base", pin.FrameType.BODY))


def controller_base(arm: Arm) -> Array:
    """transform_base_to_root (4, 4): UR's `base`, or the root where none is described."""
    if not describes_base(arm):
        return np.eye(4)
    return arm.pose(np.zeros(arm.joints), f"{arm.prefix}base")


def _build(root: ET.Element, chain: Chain) -> Any:
    """Pinocchio's model of the chain; a continuous joint is one angle, not a point on a circle.

    The limits that a revolute joint must then have go unused: the chain has the arm's.
    """
    slim = _slim(root)
    for joint in slim.findall("joint[@type='continuous']"):
        for limit in joint.findall("limit"):
            joint.remove(limit)
        joint.set("type", "revolute")
        ET.SubElement(joint, "limit", lower="-1", upper="1", effort="0", velocity="0")
    try:
        model = pin.buildModelFromXML(ET.tostring(slim, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise ArmError(f"Pinocchio refuses it: {error}") from None
    assert model.nq == model.nv == len(chain.joints), "one number a joint"
    assert list(model.names)[1:] == [joint.name for joint in chain.joints], "base first"
    return model


def _slim(element: ET.Element) -> ET.Element:
    """A copy of `element` with only what dynamics needs."""
    copy = ET.Element(element.tag, element.attrib)
    needed = NEEDED.get(element.tag, ())
    copy.extend(_slim(child) for child in element if child.tag in needed)
    return copy


def _check_bodies(links: tuple[str, ...], inertials: Array) -> None:
    """Every body, with all that is bolted to it, must be one that can be built."""
    for link, parameters in zip(links, inertials, strict=True):
        if parameters[0] <= 0.0:
            raise ArmError(f"link {link!r} moves and has no mass; give it an <inertial>")
        if not is_consistent(parameters):
            raise ArmError(f"link {link!r} has an inertia that no solid body of its mass has")
