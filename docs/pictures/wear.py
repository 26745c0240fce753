"""Draws wear.svg, the picture of the README: currents predicted, wear found and forecast.

    urdyn simulate --robot ur10e --seed 3 --duration 30 --rate 100 --out first.parquet
    urdyn identify first.parquet --robot ur10e --out model
    urdyn simulate --robot ur10e --seed 3 --run 1 --duration 600 --rate 50 \
        --fault friction_increase:joint=2,onset=150,rate=0.0006,viscous=0.0006 --out day.parquet
    urdyn track model/twin.toml day.parquet --mode realtime --out cell
    python docs/pictures/wear.py model/twin.toml day.parquet cell docs/pictures/wear.svg
"""

import json
import sys
from pathlib import Path

import numpy as np

import urdyn as ud
from urdyn.types import NORMAL90

JOINT, WINDOW = 2, (40.0, 52.0)  # [s] of currents that are shown
WIDTH, LEFT, RIGHT = 960, 64, 28
STYLE = """
svg{--ink:#1d2129;--quiet:#5c6470;--grid:#e1e5ea;--blue:#0072b2;--grey:#8a8f98;--red:#c24f00}
@media(prefers-color-scheme:dark){svg{--ink:#e4e7eb;--quiet:#9aa3ae;--grid:#30363d;--blue:#56b4e9;
--grey:#8a8f98;--red:#f0915a}}
text{font:13px system-ui,sans-serif;fill:var(--quiet)}
.t{font-size:15px;font-weight:600;fill:var(--ink)}
polyline,line{fill:none;stroke-width:1.7;stroke-linejoin:round} polygon{fill:var(--blue)}
.blue{stroke:var(--blue)} .grey{stroke:var(--grey);stroke-width:3.4;opacity:.75}
.red{stroke:var(--red)} .thin{stroke-width:1} .grid{stroke:var(--grid);stroke-width:1}
.rule{stroke:var(--quiet);stroke-width:1.2;stroke-dasharray:6 4} .dot{stroke-dasharray:2 4}
.r{fill:var(--red)} .b{fill:var(--blue)} .e{text-anchor:end} .m{text-anchor:middle}
"""


class Panel:
    """Axes: data in, pixels out."""

    def __init__(self, top, height, x, y):
        self.top, self.height, self.x, self.y = top, height, x, y

    def at(self, x, y):
        """Pixels."""
        across = LEFT + (np.asarray(x) - self.x[0]) / np.ptp(self.x) * (WIDTH - LEFT - RIGHT)
        down = self.top + (self.y[1] - np.asarray(y)) / np.ptp(self.y) * self.height
        return np.broadcast_arrays(across, down)

    def line(self, x, y, kind):
        """A line."""
        return f'<polyline class="{kind}" points="{self._points(x, y)}"/>'

    def area(self, x, low, high, opacity):
        """Between two lines."""
        points = self._points(np.append(x, x[::-1]), np.append(low, high[::-1]))
        return f'<polygon opacity="{opacity}" points="{points}"/>'

    def text(self, x, y, words, kind="", dx=0, dy=0):
        """Words at a point."""
        (a, b) = self.at(x, y)
        return f'<text class="{kind}" x="{a + dx:.0f}" y="{b + dy:.0f}">{words}</text>'

    def axes(self, xs, ys, unit, sign=""):
        """A grid with its numbers."""
        rows = [self.line(self.x, [y, y], "grid") for y in ys]
        rows += [
            self.text(self.x[0], y, f"{y:{sign if y else ''}g}".replace("-", "−"), "e", -8, 4)
            for y in ys
        ]
        rows += [
            self.text(x, self.y[0], f"{x:g}{unit if x == xs[-1] else ''}", "m", 0, 18) for x in xs
        ]
        return rows

    def _points(self, x, y):
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(*self.at(x, y), strict=True))


def currents(twin, motion):
    """The elbow's current, as motion alone tells it, and what is left."""
    t = motion.t - motion.t[0]
    measured, predicted = motion.current[:, JOINT], twin.fit.dynamics.current(motion)[:, JOINT]
    some = (t > WINDOW[0]) & (t < WINDOW[1])
    t, measured, predicted = t[some], measured[some], predicted[some]
    most = np.ceil(np.nanmax(np.abs(measured)) + 1.0)
    panel = Panel(34, 150, WINDOW, (-most, most))
    return [
        *panel.axes(np.arange(WINDOW[0], WINDOW[1] + 1, 3), (-most + 1, 0, most - 1), " s"),
        panel.line(t, measured, "grey"),
        panel.line(t, predicted, "blue"),
        panel.line(t, measured - predicted, "red thin"),
        f'<text class="t" x="{LEFT}" y="20">Current of the elbow [A]: measured, '
        '<tspan class="b">predicted from its motion</tspan>, <tspan class="r">difference</tspan>'
        "</text>",
    ]


def wear(finding, start):
    """Its friction: seen, found, forecast."""
    told, series = finding["forecast"], finding["evidence"]["series"]
    t, size, sd = (np.array(series[name]) for name in ("t", "size", "sd"))
    t, now = (t - start) / 60.0, (told["at_s"] - start) / 60.0
    ahead = now + np.array(told["ahead_s"]) / 60.0
    fan = {q: 100.0 * np.array(y) for q, y in told["quantiles"].items()}
    end, left = float(ahead[-1]), {k: v / 60.0 for k, v in told["to_critical_s"].items()}
    panel = Panel(262, 210, (0.0, end), (-8.0, 62.0))
    alarm, critical = (finding["alarm_s"] - start) / 60.0, 100.0 * told["critical"]
    levels = [(100.0 * told[name], name) for name in ("warning", "critical")]
    half = NORMAL90 * 100.0 * sd
    bar = [now + left["lo"], now + left["hi"]]
    return [
        *panel.axes(np.arange(0, end, 5), (0, 20, 40, 60), " min", "+"),
        f'<clipPath id="axes"><rect x="{LEFT}" y="{panel.top}" width="{WIDTH - LEFT - RIGHT}" '
        f'height="{panel.height}"/></clipPath><g clip-path="url(#axes)">',
        panel.area(ahead, fan["0.05"], fan["0.95"], 0.22),
        panel.area(ahead, fan["0.25"], fan["0.75"], 0.3),
        panel.area(t, 100.0 * size - half, 100.0 * size + half, 0.22),
        panel.line(t, 100.0 * size, "blue"),
        panel.line(ahead, fan["0.5"], "blue dot"),
        "</g>",
        *(panel.line((0, end), (y, y), "rule") for y, _ in levels),
        *(panel.text(0, y, f"{name} +{y:.0f} %", "", 6, -6) for y, name in levels),
        panel.line((alarm, alarm), (-8, 62), "rule"),
        panel.text(alarm, -8, f"found at {alarm:.1f} min", "", 6, -8),
        panel.line((now, now), (-8, 62), "rule"),
        panel.text(now, -8, "now", "", 6, -8),
        f'<g stroke-width="4">{panel.line(bar, (critical, critical), "red")}</g>',
        panel.text(now + left["median"], critical, "●", "m r", 0, 5),
        panel.text(
            now + left["median"], critical,
            f"{left['median']:.0f} min left ({left['lo']:.0f} to {left['hi']:.0f})", "m t", 0, 28,
        ),
        f'<text class="t" x="{LEFT}" y="248">Its friction: {100.0 * finding["size"]:+.0f} %, '
        f'{finding["severity"]}. {finding["advice"].capitalize()}.</text>',
    ]  # fmt: skip


def main(model, day, folder, out):
    """Both, in one file."""
    motion = ud.condition(ud.read(day))
    document = json.loads((folder / "findings.json").read_text())
    finding = next(f for f in document["findings"] if f["forecast"])
    body = "\n".join([*currents(ud.Twin.load(model), motion), *wear(finding, motion.t[0])])
    out.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} 500" role="img">\n'
        "<title>Motor current predicted; growing friction found and forecast</title>\n"
        f"<style>{STYLE}</style>\n{body}\n</svg>\n"
    )


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
