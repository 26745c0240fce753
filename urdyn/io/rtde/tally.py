"""What a recorder counts: packages, cycles that the controller skipped, drops, ages."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from urdyn.io.clock import SET, credible, elapsed
from urdyn.types import Array

SKIP = 1.5  # periods from stamp to stamp, beyond which a cycle in between is missing
NAMED = 1000  # gaps that are remembered with their row
WINDOW = 20  # batches whose quickest package is the reference for age
AGES = np.geomspace(1e-6, 1e2, 801)  # [s] edges of the histogram; 2.3 % wide


@dataclass(frozen=True)
class Summary:
    """A recording, so far or in the end."""

    path: str
    samples: int = 0
    lost: int = 0  # packages that the controller owed and did not send
    gaps: tuple[tuple[int, int], ...] = ()  # row after the gap, packages lost in it; the first ones
    torn: int = 0  # packages without the length of the recipe
    reconnects: int = 0
    silent: float = 0.0  # [s] without a package while connections were down: what was sent is lost
    frequency: float = 0.0  # [Hz] that was agreed on
    seconds: float = 0.0  # from the first package to the last
    age_p50: float | None = None  # [s] a package's delay beyond the quickest's around it
    age_p99: float | None = None  # [s]; None: no stamp told it
    bytes: int = 0  # of data received
    left_out: tuple[str, ...] = ()  # names that the controller does not know
    aside: str = ""  # where the file's former content is now

    @property
    def rate(self) -> float:
        """Packages a second [Hz]."""
        return (self.samples - 1) / self.seconds if self.seconds > 0 else 0.0


class Tally:
    """Counts as the batches come."""

    def __init__(self) -> None:
        self.samples = self.lost = self.torn = self.connections = self.bytes = 0
        self.gaps: list[tuple[int, int]] = []
        self.first = self.last = 0.0  # [s] when packages came
        self._stamp = np.nan  # of the package before
        self._silent, self._down = 0.0, False  # [s] of drops that are over; does one go on?
        self._quickest: deque[float] = deque(maxlen=WINDOW)
        self._ages = np.zeros(len(AGES) + 1, dtype=np.int64)

    def connect(self) -> None:
        """A connection begins: its clocks are compared with themselves only."""
        self.connections += 1
        self._stamp = np.nan
        self._quickest.clear()

    def drop(self, torn: bool) -> None:
        """A connection is lost: no stamp shows what is sent until packages come again."""
        self.torn += torn
        self._down = self.samples > 0

    def take(self, stamps: Array, received: Array, period: float) -> Array:
        """Count a batch; how many packages are missing before each, (N,)."""
        stamped, waited = np.diff(stamps, prepend=self._stamp), np.diff(received, prepend=self.last)
        steps = elapsed(stamped, waited) / period
        missing = np.where(steps > SKIP, np.rint(steps) - 1, 0)  # NaN: nothing came before
        found = np.flatnonzero(missing)[: NAMED - len(self.gaps)]
        self.gaps += [(self.samples + int(row), int(missing[row])) for row in found]
        told = credible(stamps)
        # What a network held back comes soon after, and its sum is right; a clock stays set.
        if abs(np.nansum(stamped - waited)) > SET:
            self._quickest.clear()
        elif told.any():
            self._age((received - stamps)[told])
        self._silent, self._down = self.silent(float(received[0])), False
        self.first = self.first if self.samples else float(received[0])
        self.samples += len(stamps)
        self.lost += int(missing.sum())
        self.last, self._stamp = float(received[-1]), float(stamps[-1])
        return missing

    def silent(self, now: float) -> float:
        """How long nothing came while connections were down [s], until `now`."""
        return self._silent + (now - self.last if self._down else 0.0)

    def _age(self, delay: Array) -> None:
        """The clocks' offset is unknown and drifts: the quickest package nearby sets it."""
        self._quickest.append(float(delay.min()))
        places = np.searchsorted(AGES, delay - min(self._quickest))
        self._ages += np.bincount(places, minlength=len(self._ages))

    def age(self, share: float) -> float | None:
        """Age [s] that this share of packages does not exceed; None: no stamp told any."""
        if not self._ages.any():
            return None
        place = np.searchsorted(np.cumsum(self._ages), share * self._ages.sum())
        return float(AGES[min(place, len(AGES) - 1)])

    def summary(self, path: str, now: float) -> Summary:
        """The counts as a value."""
        return Summary(
            path,
            samples=self.samples,
            lost=self.lost,
            gaps=tuple(self.gaps),
            torn=self.torn,
            reconnects=max(self.connections - 1, 0),
            silent=self.silent(now),
            seconds=self.last - self.first,
            age_p50=self.age(0.5),
            age_p99=self.age(0.99),
            bytes=self.bytes,
        )
