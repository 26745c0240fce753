"""Colours that show how much a joint has changed, and that the colour-blind can tell apart.

From blue through grey to vermilion, after Okabe and Ito; what is not known is dark.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array

LESS, SAME, MORE = np.array([[0, 114, 178], [214, 219, 225], [213, 94, 0]], dtype=float)
UNKNOWN = (96, 102, 112)
BASE = (150, 156, 165)

# Colours of joints in plots: none that the scale has, lest it be used to read a line.
LINES = ("#5D3A9B", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#7A4A00")

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Paint:
    """A quantity as a colour."""

    label: str
    unit: str
    span: float  # change at which a colour is full
    worse: int  # sign of a change for the worse, which is vermilion

    def colour(self, value: float) -> Colour:
        """Colour of a change."""
        if not np.isfinite(value):
            return UNKNOWN
        share = float(np.clip(self.worse * value / self.span, -1.0, 1.0))
        mixed: Array = SAME + abs(share) * ((MORE if share > 0.0 else LESS) - SAME)
        r, g, b = np.rint(mixed).astype(int).tolist()
        return r, g, b

    def legend(self) -> str:
        """HTML of the scale."""
        bad, good = self.worse * self.span, -self.worse * self.span
        stops = ", ".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in (LESS, SAME, MORE))
        ends = f"<span>{good:+g} {self.unit}</span><span>0</span><span>{bad:+g} {self.unit}</span>"
        ends = ends.replace("-", "−")
        return (
            f'<div style="padding:0 12px 6px;font-size:12px"><b>{self.label}</b>'
            f'<div style="height:10px;border-radius:3px;margin:4px 0;'
            f'background:linear-gradient(to right, {stops})"></div>'
            f'<div style="display:flex;justify-content:space-between">{ends}</div>'
            f'<div><i style="display:inline-block;width:10px;height:10px;border-radius:3px;'
            f'background:rgb{UNKNOWN}"></i> not known</div></div>'
        )


PAINTS = {
    "friction": Paint("friction since commissioning", "%", 50.0, 1),
    "health": Paint("drive health since commissioning", "%", 20.0, -1),
}
