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
News = tuple[int, float, float]  # which restart, its share that is behind, the value it reached

_news: Any = None  # of a worker: where it tells how far it is


def search(tasks: Sequence[Task], progress: Progress, processes: int = PROCESSES) -> list[Outcome]:
    """What every task finds, in their order, whatever the number of processes."""
    watch = _Watch(len(tasks), progress)
    processes = min(processes, len(tasks), os.cpu_count() or 1)
    if processes < 2:
        return [_alone(task, k, watch) for k, task in enumerate(tasks)]
    context = get_context("spawn")
    news: SimpleQueue[News] = context.SimpleQueue()
    with ProcessPoolExecutor(processes, context, _hire, (news,)) as pool:
        pending = [pool.submit(_work, task, k) for k, task in enumerate(tasks)]
        while wait(pending, GLANCE).not_done:
            for one in _waiting(news):
                watch.hear(one)
        return [one.result() for one in pending]


class _Watch:
    """How far all restarts are together, and the time left."""

    def __init__(self, count: int, progress: Progress) -> None:
        self._shares, self._best = [0.0] * count, float("-inf")
        self._progress, self._begin = progress, time.perf_counter()

    def hear(self, news: News) -> None:
        """Pass on what a restart says."""
        which, share, value = news
        self._shares[which] = share
        self._best = max(self._best, value)
        behind = sum(self._shares) / len(self._shares)
        left = (time.perf_counter() - self._begin) * (1.0 - behind) / max(behind, 1e-3)
        self._progress(f"criterion {self._best:.2f}, about {left:.0f} s left", behind)


def _alone(task: Task, which: int, watch: _Watch) -> Outcome:
    with threadpool_limits(1):
        return restart(task, lambda share, value: watch.hear((which, share, value)))


def _hire(news: Any) -> None:
    """A worker begins."""
    global _news
    _news = news


def _work(task: Task, which: int) -> Outcome:
    with threadpool_limits(1):
        return restart(task, lambda share, value: _news.put((which, share, value)))


def _waiting(news: Any) -> Iterator[News]:
    while not news.empty():
        yield news.get()
