"""Digital twin of Universal Robots arms: identify, track and diagnose a robot from its own data.

    import urdyn as ud
    arm = ud.load_arm("ur10e")
    fit = ud.identify(arm, ud.condition(ud.read("commissioning.csv")))
    ud.Twin(arm, fit).save("twin.toml")

Names are looked up when they are first used, so that `import urdyn` costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from inspect import Signature, signature
from types import ModuleType
from typing import TYPE_CHECKING, Any

from urdyn.lazy import lookup
from urdyn.version import __version__

if TYPE_CHECKING:
    from urdyn.diagnose import Finding, diagnose
    from urdyn.errors import UrdynError
    from urdyn.identify import Fit, PayloadPrior, Run, identify, validate
    from urdyn.identify.kinematics import calibrate
    from urdyn.io import Effort, read, write
    from urdyn.io.poses import read_poses
    from urdyn.model.arm import load_arm
    from urdyn.signal import condition, in_contact
    from urdyn.simulate import simulate
    from urdyn.tracking.offline import track
    from urdyn.twin import Twin
    from urdyn.types import Gaussian, Log, Motion, Parameters

__all__ = [
    "Effort",
    "Finding",
    "Fit",
    "Gaussian",
    "Log",
    "Motion",
    "Parameters",
    "PayloadPrior",
    "Run",
    "Twin",
    "UrdynError",
    "__version__",
    "calibrate",
    "condition",
    "diagnose",
    "identify",
    "in_contact",
    "load_arm",
    "read",
    "read_poses",
    "simulate",
    "track",
    "validate",
    "write",
]

_HOMES = {
    "urdyn.diagnose": ("Finding",),
    "urdyn.errors": ("UrdynError",),
    "urdyn.identify.kinematics": ("calibrate",),
    "urdyn.io.poses": ("read_poses",),
    "urdyn.identify": ("Fit", "PayloadPrior", "Run", "validate"),
    "urdyn.io": ("Effort", "read", "write"),
    "urdyn.model.arm": ("load_arm",),
    "urdyn.signal": ("condition", "in_contact"),
    "urdyn.tracking.offline": ("track",),
    "urdyn.twin": ("Twin",),
    "urdyn.types": ("Gaussian", "Log", "Motion", "Parameters"),
}
_find = lookup(__name__, _HOMES)
_VERBS = ("diagnose", "identify", "simulate")  # rooms that are named like the function in them


def __getattr__(name: str) -> Any:
    if name in _VERBS:
        return import_module(f"urdyn.{name}")
    return _find(name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _Verb(ModuleType):
    """A room that can be called as its function: `ud.identify(...)` beside `ud.identify.Fit`."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self._function(*args, **kwargs)

    def __reduce__(self) -> tuple[Any, ...]:
        return import_module, (self.__name__,)

    @property
    def _function(self) -> Any:
        return getattr(self, self.__name__.rpartition(".")[2])

    @property
    def __signature__(self) -> Signature:
        return signature(self._function)

    @property
    def __doc__(self) -> Any:  # type: ignore[override]  # a module's can be set
        return self._function.__doc__


class _Package(ModuleType):
    """Python binds every imported room to the package, which would hide the function so named."""

    def __setattr__(self, name: str, value: object) -> None:
        if name in _VERBS and isinstance(value, ModuleType):
            value.__class__ = _Verb
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
