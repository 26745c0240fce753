"""A calibrated arm in front of its tracker, and the Jacobian of predicted poses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.model.geometry.chain_pose import flange, reach
from urdyn.model.geometry.hayati import Form
from urdyn.model.geometry.transmission import Effects
from urdyn.model.geometry.turns import exponential, pose_of, rotation_vector
from urdyn.types import Array, Index, freeze

BASE, TOOL = 6, 6  # coordinates of a pose: three of place, three of turn


@dataclass(frozen=True, eq=False)
class Placement:
    """All that determines a pose: world = base . flange(q; table, effects) . tool."""

    form: Form
    table: Array  # (J, 5) a, alpha, beta, d, theta [m, rad]
    effects: Effects
    coefficients: Array  # (F,) of the effects
    base: Array  # (4, 4) transform_base_to_world
    tool: Array  # (4, 4) transform_tool_to_flange

    def __post_init__(self) -> None:
        freeze(self, "table", "coefficients", "base", "tool")

    @property
    def deviations(self) -> Array:
        """(P,) the geometry's coordinates minus the drawing's [m, rad]."""
        return np.asarray((self.table - self.form.nominal)[self.form.free])

    @property
    def size(self) -> int:
        """Number of all unknowns: geometry, base, tool, effects."""
        return int(self.form.free.sum()) + BASE + TOOL + len(self.coefficients)

    def flanges(self, q: Array) -> Array:
        """transform_flange_to_base (N, 4, 4)."""
        return flange(self.table, q + self.effects.shift(self.coefficients, q))

    def poses(self, q: Array) -> Array:
        """transform_tool_to_world (N, 4, 4)."""
        return np.asarray(self.base @ self.flanges(q) @ self.tool)

    def moved(self, step: Array) -> Placement:
        """The placement after a step of all unknowns, (size,)."""
        count = int(self.form.free.sum())
        geometry, base, tool, effects = np.split(step, [count, count + BASE, count + BASE + TOOL])
        turned = self.tool[:3, :3] @ Rotation.from_rotvec(tool[3:]).as_matrix()
        return replace(
            self,
            table=self.form.table(self.deviations + geometry),
            base=self.base @ exponential(base),
            tool=pose_of(self.tool[:3, 3] + tool[:3], turned),
            coefficients=self.coefficients + effects,
        )

    def with_effects(self, effects: Effects) -> Placement:
        """The same arm with these effects, all of them zero."""
        return replace(self, effects=effects, coefficients=np.zeros(len(effects.owners)))


def groups(placement: Placement) -> dict[str, Index]:
    """Indices of each kind of unknown in the vector of all."""
    bounds = np.cumsum([int(placement.form.free.sum()), BASE, TOOL])
    kinds = ("geometry", "base", "tool", "effects")
    return dict(zip(kinds, np.split(np.arange(placement.size), bounds), strict=True))


def residuals(placement: Placement, q: Array, place: Array, turn: Array) -> Array:
    """(N, 6) measured minus predicted, place [m] and rotation vector [rad], in the base's axes.

    A turn of NaN, not measured, gives NaN.
    """
    predicted = placement.poses(q)
    off = place - predicted[:, :3, 3]
    known = np.asarray(np.isfinite(turn).all(axis=(1, 2)))
    vector = np.full((len(q), 3), np.nan)
    back = np.swapaxes(predicted[known, :3, :3], 1, 2)
    if known.any():
        vector[known] = rotation_vector(turn[known] @ back)
    axes = placement.base[:3, :3]
    return np.concatenate([off @ axes, vector @ axes], axis=1)


def slopes(placement: Placement, q: Array) -> Array:
    """(N, 6, size) derivative of predicted poses in every unknown, in the base's axes."""
    form, effects = placement.form, placement.effects
    twists = reach(placement.table, q + effects.shift(placement.coefficients, q))
    lever = twists.pose[:, :3, :3] @ placement.tool[:3, 3]
    moved = np.array(twists.twists)
    moved[:, :3] += np.cross(moved[:, 3:], lever[:, None, None, :], axisa=1, axisc=1)
    turned = moved[:, :, :, 4][:, :, effects.owners] * effects.columns(q)[:, None, :]
    return np.concatenate(
        [moved[:, :, form.free], _base(twists.pose, lever), _tool(twists.pose, placement), turned],
        axis=2,
    )


def _base(pose: Array, lever: Array) -> Array:
    """(N, 6, 6) for a twist of the base in its own axes."""
    out = np.broadcast_to(np.eye(6), (len(pose), 6, 6)).copy()
    out[:, :3, 3:] = np.cross(np.eye(3), (pose[:, :3, 3] + lever)[:, None, :]).swapaxes(1, 2)
    return out


def _tool(pose: Array, placement: Placement) -> Array:
    """(N, 6, 6) for a shift of the tool in the flange's axes, and a turn in its own."""
    out = np.zeros((len(pose), 6, 6))
    out[:, :3, :3] = pose[:, :3, :3]
    out[:, 3:, 3:] = pose[:, :3, :3] @ placement.tool[:3, :3]
    return out
