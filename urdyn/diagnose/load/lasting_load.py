"""Which loads last: another tool, or one that is lost; pieces come and go.

A load that moments show clearly must be carried for as long as the rules say; the less clear, the
longer. It must also explain them better than a piece that comes and goes, of which it may be the
mean. Its clearness is measured with the belief about the arm before the program: an undetected
piece has biased what was learnt since. A load at a recording's end need not have been carried for
so long where the arm put nothing down before. Before it is reported, the bank decides whether a
joint's fault explains the same better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.kinds.rules import PAYLOAD_STATES, SlowKind
from urdyn.diagnose.kinds.suspects import Suspects
from urdyn.diagnose.load import carried, pieces
from urdyn.diagnose.load.carried import Mode
from urdyn.diagnose.load.carrying import MOMENT, Carrying
from urdyn.diagnose.load.loads import DELAY, MARGIN
from urdyn.diagnose.residual.space import Space

LASTING = 0.2  # [-] of the time away for which a lasting load must have been carried
CLEAR = 5.0  # [sd] by which its mass must differ
CERTAIN = 0.99  # [-] that a load carried for so long is another
AT_LAST = 8.0  # [s] least motion before a recording's end, where nothing was put down before


@dataclass(frozen=True, eq=False)
class LastingLoad:
    """Decides when another load lasts, and is no piece."""

    space: Space
    of: Suspects
    kind: SlowKind  # the change of payload

    def settled(
        self, carrying: Carrying, t: float, ended: bool = False
    ) -> tuple[Carrying, Change | None]:
        """The load at the tool, and its change if that lasts.

        Args:
            ended: the recording ends at t [s].
        """
        if not carrying.away:
            return carrying, None
        away = carrying.absent
        masses = np.array([mode.mean[0] for mode in carrying.modes])
        stays = int(np.argmin(np.where(away > LASTING * away.sum(), masses, np.inf)))
        mode, first = carrying.modes[stays], carrying.modes[0]
        once = ended and not carrying.handles
        if not self._long_enough(carrying, mode, AT_LAST if once else np.inf):
            return carrying, None
        if len(carrying.gone) >= pieces.RUN:
            gone, whose = zip(*((one.told, one.mode) for one in carrying.gone), strict=True)
            piece, gain = pieces.unseen(gone, first, t, whose)
            if gain > 0.0:
                modes = (*carrying.modes[:stays], piece, *carrying.modes[stays + 1 :])
                return replace(carrying.here, modes=modes), None
        return carrying.settled_on(stays, t), self._change(carrying, mode, t)

    def _change(self, carrying: Carrying, mode: Mode, t: float) -> Change:
        """The change to this mode, reported at t [s]."""
        # in this run: a light load is not found at once
        never = carrying.had <= DELAY * MOMENT
        since, sure, last = carrying.since, carrying.sure, carrying.last
        if lighter := _lighter(carrying, mode):
            never, last = False, carrying.gone[lighter - 1].begin + MOMENT
            since, sure = (one.begin for one in carrying.gone[lighter : lighter + 2])
        before = since - 2.0 * MOMENT
        began = before if never else min(before, last), sure
        return Change(
            suspect=next(k for k, each in enumerate(self.of.each) if each.kind is self.kind),
            onset=since,
            shown=began,
            began=began,
            alarm=t,
            confidence=CERTAIN,
            evidence=np.nan,
            size=float(mode.mean[0] - carrying.modes[0].mean[0]),
            size_sd=carrying.weighed,
            rate=0.0,
            rate_sd=0.0,
            detail=tuple(mode.mean[: len(PAYLOAD_STATES)].tolist()),
            older=never,
        )

    def _long_enough(self, carrying: Carrying, mode: Mode, hold: float) -> bool:
        """Whether it is another load, and the first away for long enough, or for `hold` [s]."""
        away, more = carrying.absent.sum(), mode.mean - carrying.modes[0].mean
        hold = min(hold, self.kind.hold_lighter if more[0] < 0.0 else self.kind.hold)
        if abs(more[0]) < max(self.kind.least, CLEAR * np.sqrt(mode.cov[0, 0])) or away < hold:
            return False
        told = np.mean([one.told.C for one in carrying.gone], axis=0)
        clear = 0.5 * (DELAY + 1) * more @ told @ more  # nats in the waiting moments
        known = away * clear >= hold * (carried.SURE + MARGIN)
        return bool(known) and carried.possible(mode, self.space.reference.payload)


def _lighter(carrying: Carrying, mode: Mode) -> int:
    """Number of moments away, before this load, with a load that surely weighs less."""
    masses = [other.mean[0] + CLEAR * np.sqrt(other.cov[0, 0]) for other in carrying.modes]
    least = mode.mean[0] - CLEAR * np.sqrt(mode.cov[0, 0])
    others = (masses[one.mode] >= least for one in carrying.gone[:-1])
    return next((k for k, same in enumerate(others) if same), 0)
