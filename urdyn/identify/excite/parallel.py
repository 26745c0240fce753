"""Several restarts side by side, and how far they are."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from multiprocessing import get_context
from multiprocessing.queues import SimpleQueue
from typing import Any

from threadpoolctl import threadpool_limits

from urdyn.errors import UnsafeMotionError
from urdyn.identify.excite.restart import Found, Task, restart
from urdyn.progress import Progress

PROCESSES = 2
GLANCE = 0.2  # [s] between two looks at how far they are

Outcome = Found | UnsafeMotionError
Update = tuple[int, float, float]  # which restart, the share that is behind, the value it reached

_updates: Any = None  # of a worker process: the queue to the one that waits


def search(tasks: Sequence[Task], progress: Progress, processes: int = PROCESSES) -> list[Outcome]:
    """What every task finds, in their order, whatever the number of processes."""
    watch = _Watch(len(tasks), progress)
    processes = min(processes, len(tasks), os.cpu_count() or 1)
    if processes < 2:
        return [_alone(task, k, watch) for k, task in enumerate(tasks)]
    context = get_context("spawn")
    updates: SimpleQueue[Update] = context.SimpleQueue()
    with ProcessPoolExecutor(processes, context, _init_worker, (updates,)) as pool:
        pending = [pool.submit(_work, task, k) for k, task in enumerate(tasks)]
        while wait(pending, GLANCE).not_done:
            for one in _waiting(updates):
                watch.hear(one)
        return [one.result() for one in pending]


class _Watch:
    """How far all restarts are together, and the time left."""

    def __init__(self, count: int, progress: Progress) -> None:
        self._shares, self._best = [0.0] * count, float("-inf")
        self._progress, self._begin = progress, time.perf_counter()

    def hear(self, update: Update) -> None:
        """Pass on what a restart says."""
        which, share, value = update
        self._shares[which] = share
        self._best = max(self._best, value)
        behind = sum(self._shares) / len(self._shares)
        left = (time.perf_counter() - self._begin) * (1.0 - behind) / max(behind, 1e-3)
        self._progress(f"criterion {self._best:.2f}, about {left:.0f} s left", behind)


def _alone(task: Task, which: int, watch: _Watch) -> Outcome:
    with threadpool_limits(1):
        return restart(task, lambda share, value: watch.hear((which, share, value)))


def _init_worker(updates: Any) -> None:
    """Once in every worker process."""
    global _updates
    _updates = updates


def _work(task: Task, which: int) -> Outcome:
    with threadpool_limits(1):
        return restart(task, lambda share, value: _updates.put((which, share, value)))


def _waiting(updates: Any) -> Iterator[Update]:
    while not updates.empty():
        yield updates.get()
