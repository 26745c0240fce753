"""What can go wrong, as a tree.

UrdynError                  everything that the caller can mend; the command line exits 1 on it
├── InputError              a file or an option cannot be used
│   ├── LogError            a recording: carries path, line, column
│   ├── ArmError            a robot description
│   ├── TwinError           a twin.toml
│   ├── CampaignError       a campaign.toml
│   └── UnsafeMotionError   a motion that cannot be proven safe: carries what, kind, when
├── IdentifiabilityError    the data do not determine what was asked
├── RtdeError               a controller or client is unreachable or breaks RTDE: carries address
└── MissingExtraError       an optional dependency is not installed: carries extra, package
"""

from __future__ import annotations

from pathlib import Path


class UrdynError(Exception):
    """Root of the tree: one sentence that says what is wrong, where, and what to do."""


class InputError(UrdynError):
    """A file or an option cannot be used."""


class LogError(InputError):
    """A recording cannot be used.

    `line` counts from 1 in the file as an editor shows it; 0 where no line is to blame.
    """

    def __init__(
        self, message: str, path: str | Path = "", line: int = 0, column: str = ""
    ) -> None:
        where = f"{path}:{line}" if line else str(path)
        super().__init__(f"{where}: {message}" if where else message)
        self.path, self.line, self.column = str(path), line, column


class ArmError(InputError):
    """A robot description cannot be used."""


class TwinError(InputError):
    """A twin.toml cannot be used."""


class CampaignError(InputError):
    """A campaign.toml cannot be used."""


class UnsafeMotionError(InputError):
    """A motion cannot be proven safe: carries what falls short in words, its kind, and when."""

    def __init__(self, what: str, kind: str, when: float) -> None:
        super().__init__(what, kind, when)  # unformatted, so that it can be pickled
        self.what, self.kind, self.when = what, kind, when

    def __str__(self) -> str:
        return f"not proven safe: {self.what} at {self.when:.3f} s"


class IdentifiabilityError(UrdynError):
    """The data do not determine what was asked of them."""


class RtdeError(UrdynError):
    """A controller, or a client of ours, cannot be reached or breaks the RTDE protocol.

    `address` is host:port; "" where no socket is involved.
    """

    def __init__(self, message: str, address: str = "") -> None:
        super().__init__(f"{address}: {message}" if address else message)
        self.address = address


class MissingExtraError(UrdynError):
    """An optional dependency is not installed."""

    def __init__(self, extra: str, package: str) -> None:
        super().__init__(extra, package)  # unformatted, so that it can be pickled
        self.extra, self.package = extra, package

    def __str__(self) -> str:
        return (
            f"{self.package} is not installed; in urdyn's clone: pip install -e '.[{self.extra}]'; "
            f"from its wheel: pip install 'WHEEL[{self.extra}]'"
        )
