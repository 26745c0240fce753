"""The loops: a film that is played, a robot that is watched."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable

import numpy as np

from urdyn.view.film import Film, Moment, film
from urdyn.view.stage import Stage

PERIOD = 0.04  # [s] between two pictures
EVERY = 6  # pictures between two drawings of numbers and plots
BACK = 60.0  # [s] that the plots go back

Going = Callable[[], bool]


def play(stage: Stage, shown: Film, going: Going = lambda: True) -> None:
    """Play a film again and again, as fast and from where the user asks."""
    controls = stage.panel.controls
    at, put, picture = 0.0, 0.0, 0
    while going():
        began = time.monotonic()
        slid = float(controls["time"].value)
        at = slid if slid != put else at  # the user has moved the slider
        moment = shown.at(at)
        stage.show(moment)
        if picture % EVERY == 0:
            stage.tell(moment, before(shown, at))
        picture += 1
        time.sleep(max(0.0, PERIOD - (time.monotonic() - began)))
        if controls["play"].value:
            at += (time.monotonic() - began) * float(controls["speed"].value)
            at = 0.0 if at > shown.end else at
            put = round(at, 2)
            controls["time"].value = put


def watch(stage: Stage, moments: Iterable[Moment], going: Going = lambda: True) -> None:
    """A robot at work, until nothing more comes."""
    past: deque[Moment] = deque()
    for picture, moment in enumerate(moments):
        past.append(moment)
        while past[0].t < moment.t - BACK:
            past.popleft()
        stage.show(moment)
        if picture % EVERY == 0:
            stage.tell(moment, film(past))
        if not going():
            return


def before(shown: Film, t: float) -> Film:
    """The film up to `t` [s], as far back as plots go."""
    first, last = np.searchsorted(shown.t, [t - BACK, t]).tolist()
    return shown.slice(first, max(first, last) + 1)
