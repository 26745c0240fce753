"""filterpy's sigma points, without the rest of filterpy.

`import filterpy.kalman.sigma_points` first runs the package, which imports all of its filters and
scipy.stats: .65 s, and 187 MB instead of 126 for `urdyn track`, for twenty lines. So that one file
is loaded by its path. It imports a print function and a Cholesky factor; while it loads, stand-ins
replace the modules that have these.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

NAME = "filterpy.kalman.sigma_points"
STAND_INS = {
    "filterpy.common": SimpleNamespace(pretty_str=lambda label, x: f"{label} = {x}"),
    "scipy.linalg": np.linalg,  # for `cholesky`, of the identity alone
}


@lru_cache(maxsize=1)
def filterpy_points() -> Any:
    """The module filterpy.kalman.sigma_points; the one already imported if there is one."""
    if NAME in sys.modules:
        return sys.modules[NAME]
    package = find_spec("filterpy")  # does not run it
    assert package is not None and package.origin is not None, "filterpy is a dependency"
    spec = spec_from_file_location(NAME, Path(package.origin).parent / "kalman" / "sigma_points.py")
    assert spec is not None and spec.loader is not None, "it is a Python file"
    module = module_from_spec(spec)
    with _found_as(STAND_INS):
        spec.loader.exec_module(module)
    return module


@contextmanager
def _found_as(modules: Mapping[str, Any]) -> Iterator[None]:
    """Replace the modules of these names for imports within the block."""
    before = {name: sys.modules[name] for name in modules if name in sys.modules}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name in modules:
            del sys.modules[name]
        sys.modules.update(before)
