"""What is to be diagnosed, and where; also as plain data for another process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from urdyn.diagnose.kinds.fast_rules import fast_rules
from urdyn.diagnose.kinds.rules import Noise, Rules, SlowKind
from urdyn.faults.decision import Costs
from urdyn.identify.fit import Fit

KEPT = "diagnosis-{index}.npz"


@dataclass(frozen=True)
class Job:
    """A run that is diagnosed while it is tracked."""

    fit: Fit
    period: float  # [s] between rows
    rules: Rules
    folder: Path
    index: int  # of the first sample; above 0 it resumes from what was kept there
    identity: Mapping[str, str]
    source: Mapping[str, str]

    def plain(self) -> dict[str, Any]:
        """As numbers and words, without the fit; `job_of` reads it."""
        return {
            "period": self.period,
            "rules": asdict(self.rules),
            "folder": str(self.folder.absolute()),
            "index": self.index,
            "identity": dict(self.identity),
            "source": dict(self.source),
        }


def job_of(fit: Fit, plain: Mapping[str, Any]) -> Job:
    """The job from its `Job.plain`."""
    told = plain["rules"]
    slow = tuple(SlowKind(**of | {"shapes": tuple(of["shapes"])}) for of in told["slow"])
    parts = {"noise": Noise(**told["noise"]), "slow": slow, "costs": Costs(**told["costs"])}
    parts["fast"] = fast_rules(told["fast"])
    rules, folder = Rules(**told | parts), Path(plain["folder"])
    return Job(**{**plain, "fit": fit, "rules": rules, "folder": folder})
