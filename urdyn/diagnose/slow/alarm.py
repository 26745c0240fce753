"""An alarm: its most likely change, and whether that is clear enough to be reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.slow.explanation import Explanation
from urdyn.diagnose.slow.onsets import WITHIN, Bank
from urdyn.types import Array

CONFIDENT = 0.95  # [-] share of the evidence at which a finding need not wait for a clearer name
PATIENCE = 12  # blocks that an alarm waits for that
TWICE = 2  # blocks at least: the next one confirms what one shows, or retracts it
BORNE_OUT = 10.0  # [s] since its onset, needed to report it at a recording's end


@dataclass(frozen=True, eq=False)
class Alarm:
    """The suspect that explains it best, and its rivals."""

    suspect: int
    told: Explanation
    share: float  # [-] of the evidence
    rivals: tuple[tuple[int, float], ...]  # other suspects and their shares

    @property
    def confident(self) -> bool:
        """Whether its name need not become clearer."""
        return self.share >= CONFIDENT

    def ripe(self, bank: Bank, waited: int) -> bool:
        """Whether it has waited for as many blocks as its name needs, and they confirm it.

        Time waited for an alarm's name does not count for a change that has just begun.
        """
        # Each block has len(WITHIN) onsets: those from this one on span TWICE blocks.
        borne_out = np.count_nonzero(bank.onset >= self.told.onset) > (TWICE - 1) * len(WITHIN)
        enough = waited >= (TWICE if self.confident else PATIENCE)
        return bool(enough and (borne_out or waited == TWICE))

    def ripe_at_the_end(self, bank: Bank, waited: int) -> bool:
        """The same where no more blocks come."""
        lasted = bank.t - self.told.onset > BORNE_OUT
        return bool(lasted and (self.confident or waited > TWICE))

    def change(self, detail: tuple[float, ...] = ()) -> Change:
        """The alarm's change, as one that lasts.

        Args:
            detail: of a payload: mass, mx, my, mz.
        """
        told = self.told
        return Change(
            suspect=self.suspect,
            onset=told.began[1],
            shown=told.shown,
            began=(told.began[0], told.began[2]),
            alarm=told.t,
            confidence=self.share,
            evidence=told.evidence,
            size=told.size,
            size_sd=told.size_sd,
            rate=told.rate,
            rate_sd=told.rate_sd,
            detail=detail,
            rivals=self.rivals,
            older=told.older,
        )


def alarm_of(candidates: Mapping[int, Explanation], evidence: Array) -> Alarm:
    """The most likely explanation of an alarm.

    Args:
        candidates: suspects, and each one's explanation; one at least.
        evidence: of each suspect, (h,) [nats].
    """
    of = list(candidates)
    share = np.exp(evidence[of] - logsumexp(evidence[of]))
    first, *others = np.argsort(-share, kind="stable")[:3].tolist()
    rivals = tuple((of[k], float(share[k])) for k in others)
    return Alarm(of[first], candidates[of[first]], float(share[first]), rivals)
