"""A line the size of a word: no axes, no script, the same on screen and on paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.report.markup import Html, text
from urdyn.types import Array

WIDTH, HEIGHT = 100.0, 30.0  # of the drawing's own coordinates


@dataclass(frozen=True, eq=False)
class Spark:
    """A quantity over time, on a scale that its neighbours share."""

    t: Array  # (N,) [s]
    y: Array  # (N,)
    half: Array  # (N,) half width of its interval
    base: float  # where it began
    low: float  # at the bottom
    high: float  # at the top

    def draw(self, words: str, moved: bool) -> Html:
        """As SVG; `words` describe it to those who cannot see it."""
        x = WIDTH * self.t / max(float(self.t[-1]), 1e-9)
        upper, lower = (self._up(self.y + sign * self.half) for sign in (1.0, -1.0))
        band = _points(np.append(x, x[::-1]), np.append(upper, lower[::-1]))
        base = float(self._up(np.array([self.base]))[0])
        line, end = _points(x, self._up(self.y)), _points(x[-1:], self._up(self.y[-1:]))
        return Html(
            f'<svg class="spark{" moved" if moved else ""}" role="img" aria-label="{text(words)}" '
            f'viewBox="0 0 {WIDTH:g} {HEIGHT:g}" preserveAspectRatio="none">'
            f'<polygon points="{band}"/><path class="base" d="M0 {base:.1f}H{WIDTH:g}"/>'
            f'<polyline points="{line}"/><path class="end" d="M{end}h0"/></svg>'
        )

    def _up(self, y: Array) -> Array:
        """Heights in the drawing, (N,); what lies beyond the scale lies on its edge."""
        share = (y - self.low) / (self.high - self.low)
        return np.asarray(HEIGHT * (1.0 - np.clip(share, 0.04, 0.96)))


def _points(x: Array, y: Array) -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
