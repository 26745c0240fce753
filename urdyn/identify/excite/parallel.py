"""Several restarts in parallel, and their progress."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.queues import SimpleQueue
from threading import Thread
from typing import Any

from threadpoolctl import threadpool_limits

from urdyn.errors import UnsafeMotionError, UrdynError
from urdyn.identify.excite.restart import Found, Task, restart
from urdyn.io.deaf import deaf_to_interrupts
from urdyn.progress import Progress

GLANCE = 0.2  # [s] between two checks of progress

Outcome = Found | UnsafeMotionError
Update = tuple[int, float, float]  # which restart, the share done, the value reached

_updates: Any = None  # in a worker process: the queue to the parent


def search(tasks: Sequence[Task], progress: Progress, processes: int) -> list[Outcome]:
    """Outcomes of all tasks, in order, whatever the number of processes."""
    watch = _Watch(len(tasks), progress)
    processes = min(processes, len(tasks), os.cpu_count() or 1)
    if processes < 2:
        return [_alone(task, k, watch) for k, task in enumerate(tasks)]
    context = get_context("spawn")
    updates: SimpleQueue[Update] = context.SimpleQueue()
    with ProcessPoolExecutor(processes, context, _init_worker, (updates,)) as pool, _ended(pool):
        with deaf_to_interrupts():
            pending = [pool.submit(_work, task, k) for k, task in enumerate(tasks)]
        while wait(pending, GLANCE).not_done:
            for one in _waiting(updates):
                watch.hear(one)
        return [one.result() for one in pending]


class _Watch:
    """Progress of all restarts together, and the time left."""

    def __init__(self, count: int, progress: Progress) -> None:
        self._shares, self._best = [0.0] * count, float("-inf")
        self._progress, self._begin = progress, time.perf_counter()

    def hear(self, update: Update) -> None:
        """Take a restart's update."""
        which, share, value = update
        self._shares[which] = share
        self._best = max(self._best, value)
        behind = sum(self._shares) / len(self._shares)
        left = (time.perf_counter() - self._begin) * (1.0 - behind) / max(behind, 1e-3)
        self._progress(f"criterion {self._best:.2f}, about {left:.0f} s left", behind)


def _alone(task: Task, which: int, watch: _Watch) -> Outcome:
    with threadpool_limits(1):
        return restart(task, lambda share, value: watch.hear((which, share, value)))


@contextmanager
def _ended(pool: ProcessPoolExecutor) -> Iterator[None]:
    """If this block fails, also by Ctrl-C, end the workers without waiting for them."""
    try:
        yield
    except BrokenProcessPool as error:
        told = "a worker was killed, as where memory is short; run again, with fewer --processes"
        raise UrdynError(told) from error
    except BaseException:
        for worker in list(pool._processes.values()):  # from Python 3.14 on: terminate_workers()
            worker.terminate()
        raise


def _init_worker(updates: Any) -> None:
    """Set up a worker process."""
    global _updates
    _updates = updates
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker if its parent is killed."""
    parent = parent_process()
    assert parent is not None, "a worker is somebody's"
    parent.join()
    os._exit(1)


def _work(task: Task, which: int) -> Outcome:
    with threadpool_limits(1):
        return restart(task, lambda share, value: _updates.put((which, share, value)))


def _waiting(updates: Any) -> Iterator[Update]:
    while not updates.empty():
        yield updates.get()
