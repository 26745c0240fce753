"""The loop: samples in, history out, and a checkpoint now and then."""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Generic

import numpy as np
from threadpoolctl import threadpool_limits

from urdyn.errors import InputError
from urdyn.estimate.protocol import S
from urdyn.io import alone
from urdyn.io.clock import elapsed
from urdyn.io.helper import Helper
from urdyn.io.rss import peak_rss
from urdyn.model.whose import require_own
from urdyn.tracking.belief import beliefs, interest
from urdyn.tracking.belief.payload_holds import Hold, Holds
from urdyn.tracking.belief.payload_setting import Setting, agrees, at_the_end
from urdyn.tracking.belief.physical import Quantities, quantities, weighed
from urdyn.tracking.belief.reading import Reading
from urdyn.tracking.belief.spare_payload import rest_of
from urdyn.tracking.modes import mode_of
from urdyn.tracking.output import checkpoint
from urdyn.tracking.output.checkpoint import Checkpoint
from urdyn.tracking.output.history_parts import discard_parts, drop_others, writing_parts
from urdyn.tracking.output.history_row import row, spacing
from urdyn.tracking.output.keeper import Keeper, begin_scribe
from urdyn.tracking.output.latency import Latency
from urdyn.tracking.output.observer import Observer
from urdyn.tracking.output.progress import RunProgress, Watch
from urdyn.tracking.output.summary import Summary, final, ill_sensors, quality
from urdyn.tracking.sources.another_robot import of_this_arm
from urdyn.tracking.sources.losses import Losses, counted, no_losses
from urdyn.tracking.sources.restarts import arrivals
from urdyn.tracking.sources.source import Arrival, Source, now
from urdyn.tracking.step.state import TrackerState, begun_anew
from urdyn.tracking.step.tracker import Tracker
from urdyn.version import __version__

SWITCH = 5e-4  # [s] after which one thread yields to another
PART = 10.0  # [s] of data between checkpoints, to be repeated after a kill
AGAIN = 1000  # samples of a recording between checkpoints, at least: about a second of work
ALIKE = 0.05  # [-] by which one stream's period may differ, estimated from a few stamps each time


def run(
    tracker: Tracker[S],
    source: Source,
    out: Path,
    twin_sha256: str = "",
    fresh: bool = False,
    watch: Watch | None = None,
    observer: Observer | None = None,
    writer: Helper | None = None,
) -> dict[str, Any]:
    """Track `source` to its end and write DIR/history.parquet.

    A killed run goes on from its checkpoint, and a live one from where it ended.

    Args:
        out: DIR; created if missing.
        twin_sha256: of the twin's file: a run goes on only with the same twin.
        fresh: begin anew instead.
        watch: called with every instant.
        observer: observes the run, and adds its findings at the end.
        writer: a process that `begin_scribe` started early.

    Returns:
        The document of a `Summary`, with what the observer adds.

    Raises:
        InputError: the source has other joints than the twin, or is another arm's (which a robot
            tells as it moves), is damaged, or is too short; or DIR is in use, or holds another run,
            or a damaged one.
    """
    joints = tracker.fit.dynamics.arm.joints
    if source.joints != joints:
        raise InputError(f"{source.name}: has {source.joints} joints, the twin has {joints}")
    if source.glimpse:
        require_own(tracker.fit.dynamics.arm, source.glimpse)
    out.mkdir(parents=True, exist_ok=True)
    if lack := beliefs.lacking(tracker.filter):
        source.tell(lack)
    # The matrices are small: linear algebra threads would wait for one another.
    with alone(out), threadpool_limits(1):
        if fresh:
            checkpoint.remove(out)
        tracker, source = _at_the_pace(checkpoint.whose(out), tracker, source)
        identity = {
            "version of urdyn": __version__,
            "twin": twin_sha256,
            "source": source.identity,
            "network": repr(tracker.network),  # to the last digit of its coefficients
            **_settings(tracker),
        }
        tool = float(tracker.fit.dynamics.payload[0])
        start = Checkpoint(
            state=tracker.init(),
            interest=interest.nothing_yet(joints),
            losses=no_losses(joints),
            setting=Setting(tool=tool),
        )
        with writing_parts(out):
            begun = checkpoint.load(start, identity, out)
            drop_others(out, begun.parts)
        of = quantities(tracker.fit, tracker.currents, tracker.beside)
        with ExitStack() as ends:
            if source.live:
                ends.enter_context(_at_pace())
            scribe = ends.enter_context(closing(writer or begin_scribe()))
            if observer:
                ends.enter_context(closing(observer))
                observer.begin(out, begun.index, identity)
            origin = _origin(tracker, source, twin_sha256)
            keeper: Keeper[S] = Keeper(out, of, identity, origin, observer, scribe)
            this = _Run(
                tracker=tracker,
                source=source,
                out=out,
                quantities=of,
                keeper=keeper,
                watch=watch,
                observer=observer,
            )
            return this.to_the_end(begun)


def _settings(tracker: Tracker[S]) -> dict[str, str]:
    """Settings that must not change when a run is resumed."""
    return {
        "filter": str(tracker.filter),
        "drift": str(tracker.drift),
        "period": str(tracker.period),
        "choice of streams": str(tracker.beside),
    }


def _origin(tracker: Tracker[S], source: Source, twin_sha256: str) -> dict[str, str]:
    """Provenance that a history records."""
    return {
        "urdyn": __version__,
        "robot": tracker.fit.dynamics.arm.name,
        "twin.sha256": twin_sha256,
        "source": source.name,
        "source.sha256": source.sha256,
        "settings": " ".join(_settings(tracker).values()),
    }


def _at_the_pace(
    begun: Mapping[str, str], tracker: Tracker[S], source: Source
) -> tuple[Tracker[S], Source]:
    """With the period that a live run was `begun` with: a new estimate differs slightly."""
    period = float(begun.get("period", "nan"))
    if source.live and abs(source.period - period) < ALIKE * period:
        return replace(tracker, period=period), replace(source, period=period)
    return tracker, source


@contextmanager
def _at_pace() -> Iterator[None]:
    """Keep samples from waiting for long.

    Publishing threads yield soon; garbage is collected among new objects, not all that was loaded.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before)


@dataclass(frozen=True, eq=False)
class _Run(Generic[S]):
    """One run: what is tracked, who is told of it, and how long that takes."""

    tracker: Tracker[S]
    source: Source
    out: Path
    quantities: Quantities
    keeper: Keeper[S]
    watch: Watch | None
    observer: Observer | None
    pace: Latency = field(default_factory=Latency)  # of samples; a robot's from when they came
    work: Latency = field(default_factory=Latency)  # of computing

    def to_the_end(self, begun: Checkpoint[S]) -> dict[str, Any]:
        """Process every remaining sample, then finish the files."""
        begin = time.perf_counter()
        self._note(begun)
        at, newest = self._followed(begun)
        self._note(at)
        self._show_ended(newest)  # the arm is not stale while its run ends
        found = self.observer.finish() if self.observer else {}
        self._show_ended(newest)
        changes = self._finish(at)
        return self._summary(at, found, changes, begin).plain() | dict(found)

    def _followed(self, at: Checkpoint[S]) -> tuple[Checkpoint[S], RunProgress | None]:
        """Where the run is after every remaining sample, and the newest glance at it."""
        begun = at.index if self.source.live else 0  # a live source's length counts from here
        part = max(1 if self.source.live else AGAIN, round(PART / self.source.period))
        before: Arrival | None = None
        newest: RunProgress | None = None
        due = False
        for arrival in self._arrivals(at):
            started = time.perf_counter()
            lost = self._missing(before, arrival) if before else 0
            at, reading = self._step(at, arrival, lost)
            before = arrival
            done = time.perf_counter() - started
            self.work.take(done)
            delay = now() - arrival.received if self.source.live else 0.0
            self.pace.take(delay if self.source.live else done)
            if reading is not None:
                newest = self._show(at, reading, delay, begun)
                at = self._held(self._gathered(at, reading), newest)
            due = due or at.index % part == 0
            # A robot does not wait for the disk or the observer: its next checkpoint does.
            if due and (self.keeper.settled or not self.source.live):
                self._note(at)
                at, due = self.keeper.keep(at), False
            self.keeper.go_on()
        return at, newest

    def _arrivals(self, at: Checkpoint[S]) -> Iterator[Arrival]:
        """The remaining samples; LogError at those of a robot that is not the twin's."""
        came = arrivals(self.source, at.index, at.last, at.ahead)
        if not self.source.live:
            return came
        return of_this_arm(self.tracker.fit.dynamics.arm, came, self.source.name)

    def _summary(
        self, at: Checkpoint[S], found: Mapping[str, Any], changes: list[float], begin: float
    ) -> Summary:
        """The results of a run that began at `begin` [s].

        Args:
            found: the observer's document.
            changes: when the payload was taken to have changed [s].
        """
        told, arm = final(self.tracker, self.quantities, at), self.tracker.fit.dynamics.arm
        known = weighed(self.tracker.believed(at.state), self.tracker.currents)
        setting = at.setting
        if ill_sensors(found):
            known, setting = False, replace(setting, hold=Hold(), holds=Holds())
        return Summary(
            robot=arm.name,
            samples=at.index,
            lost=at.losses.lost if self.source.live else None,
            data_s=float(np.nan_to_num(at.last - at.began)) - at.losses.gaps_s,
            wall_s=time.perf_counter() - begin,
            rate_hz=self.work.count / self.work.total if self.work.count else 0.0,
            latency_ms=self.pace.summary(),
            rss_mb=peak_rss() / 1e6,
            filter=type(self.tracker.filter).__name__,
            mode=mode_of(self.tracker.filter),
            final=told,
            quantities=interest.as_plain(at.interest, arm.joint_names, rest_of(arm, told, known)),
            quality=quality(self.tracker, self.source, at),
            payload_changes=changes,
            payload_known=known,
            payload_setting=at_the_end(setting, told, self.quantities.whole, known),
        )

    def _step(
        self, at: Checkpoint[S], arrival: Arrival, lost: int
    ) -> tuple[Checkpoint[S], Reading | None]:
        """Take one sample, after `lost` ones that did not come."""
        t = arrival.sample.t
        before = begun_anew(at.state, self.tracker.init()) if arrival.reset else at.state
        state, reading = self.tracker.step(before, arrival.sample)
        if self.observer:
            if reading:
                self.observer.take(reading)
            else:
                self.observer.miss(*self.tracker.missed(state))
        set_back = max(at.last - t, 0.0) if np.isfinite(at.last) else 0.0
        after = replace(
            at,
            state=state,
            losses=self._losses(at, before, arrival, lost),
            setting=at.setting.heard(arrival.sample.setting, state.moved - before.moved),
            index=at.index + 1,
            began=at.began - set_back if np.isfinite(at.began) else t,
            last=t,
            ahead=arrival.ahead,
        )
        return after, reading

    def _losses(
        self, at: Checkpoint[S], before: TrackerState[S], arrival: Arrival, lost: int
    ) -> Losses:
        """What the stream has lacked, up to this sample, after `lost` ones that did not come."""
        stretch = before.causal.t  # the whole stretch, where it is too short to learn from
        few = len(stretch) if len(stretch) < self.tracker.enough else 0
        since = float(stretch[0]) if few else np.nan
        period = self.source.period
        losses = counted(at.losses, arrival.sample, at.last, period, since, few, lost)
        if arrival.ahead == at.ahead:
            return losses
        return replace(losses, clock_set=losses.clock_set + 1)

    def _missing(self, before: Arrival, arrival: Arrival) -> int:
        """Number of samples missing between two: by their stamps, unless a clock was set."""
        stamped, waited = arrival.sample.t - before.sample.t, arrival.received - before.received
        stamped -= arrival.ahead - before.ahead
        return max(0, round(float(elapsed(stamped, waited)) / self.source.period) - 1)

    def _show(self, at: Checkpoint[S], reading: Reading, delay: float, begun: int) -> RunProgress:
        """Inform the watcher; every k-th sample, and a new payload, also give a row of history."""
        due = at.index % spacing(self.source.period) == 0 or reading.widened
        progress = RunProgress(
            t=at.last - at.began,
            last=at.last,
            samples=at.index,
            share=(at.index - begun) / self.source.length if self.source.length else 0.0,
            rate=self.work.count / self.work.total,
            reading=reading,
            quantities=self.quantities,
            row=due,
            setting=at.setting,
            delay=delay,
            **self._found(),
        )
        if self.watch:
            self.watch(progress)
        if due:
            self.keeper.take(row(reading, progress.mean, progress.sd))
        return progress

    def _show_ended(self, newest: RunProgress | None) -> None:
        """Inform the watcher that nothing more will come, with the findings by now."""
        if self.watch and newest:
            self.watch(replace(newest, row=True, ended=True, **self._found()))

    def _found(self) -> dict[str, Any]:
        """Findings and doubt, for a `RunProgress`."""
        if not self.observer:
            return {}
        return {"findings": self.observer.findings, "doubt": self.observer.doubt}

    def _note(self, at: Checkpoint[S]) -> None:
        """Give the observer what no reading contains."""
        if self.observer:
            told = final(self.tracker, self.quantities, at)
            self.observer.note(int(at.state.restarts), agrees(at.setting, told))

    def _gathered(self, at: Checkpoint[S], reading: Reading) -> Checkpoint[S]:
        """With one more reading in the quantities of interest."""
        every, commissioned = spacing(self.source.period), self.tracker.model.prior.mean
        due = at.index % every == every // 2  # between two rows, so that no sample does both
        found = interest.after(at.interest, reading, self.quantities, commissioned, due)
        return at if found is at.interest else replace(at, interest=found)

    def _held(self, at: Checkpoint[S], shown: RunProgress) -> Checkpoint[S]:
        """With what is carried compared with the controller's setting, at rows of the history."""
        if not shown.row:
            return at
        load = self.quantities.names.index("payload.mass")
        known = weighed(shown.reading.belief, self.tracker.currents)
        known = known and not at.state.rest.just(shown.reading.t)
        now = float(shown.mean[load]), float(shown.sd[load])
        return replace(at, setting=at.setting.beside(*now, known, shown.reading.unknown))

    def _finish(self, at: Checkpoint[S]) -> list[float]:
        """Write the whole history; returns when the payload was taken to have changed [s].

        A recording's checkpoint and parts are removed; a live run may be resumed.
        """
        at = self.keeper.keep(at)
        self.keeper.settle()
        if not at.parts:
            raise InputError(f"{self.source.name}: too short, or too full of gaps, to be tracked")
        changes = self.keeper.join(at.parts)
        if not self.source.live:
            checkpoint.remove(self.out)
            discard_parts(self.out)
            if self.observer:
                self.observer.forget()
        return changes
