"""What `urdyn bench track` measured, as tables and notes for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from urdyn.report.digits import MISSING, hundredths, number
from urdyn.report.terminal import terminal_table

Document = dict[str, Any]


def tables(document: Document) -> list[Table]:
    """Ramps, then Tables I, II and IV, then the coverage of intervals."""
    return [
        _ramps(document["ramps"]),
        _table_1(document["table_1"]),
        _table_2(document["table_2"]),
        _table_4(document["table_4"]),
        *(_truth(arms) for arms in document["truth"]),
    ]


def notes(document: Document) -> list[Table | str]:
    """Conditions of the figures."""
    arm, made = document["arm"], document["reconstruction"].items()
    units = (
        (f"{row['name']} ({row['symbol']})", row["arm"]["unit"], row["comparable"])
        for row in document["table_1"]
    )
    heads = ("group", "arm's unit", "with the paper's number")
    return [
        terminal_table("Reconstructed, for the paper does not say", ("what", "as"), made, 2),
        terminal_table("Can Table I be compared?", heads, units, 3),
        "Bound: the posterior Cramér-Rao bound; on ramps and on the scenario that of a filter that "
        "is told the onset, on the arms what an EKF says of its own error, Tichavsky's recursion "
        "along the estimate. It is one of the mean over everything drawn: few arms may be below it "
        "by luck, as far as ± says.",
        "On the scenario f and alpha are linear: EKF, UKF and variational inference are the same "
        "filter there; only the process model makes a difference.",
        f"Arms: {arm['arms']} virtual {arm['robot']}, {arm['duration_s']:g} s at "
        f"{arm['rate_hz']:g} Hz, commissioned on other motion; errors over the second half. No "
        "single mass shows on a fixed base: their error is the prior's. Time and memory are those "
        "of `urdyn track` in a process of its own, on the first of them; p99 is of this machine as "
        "busy as it was.",
        "All arms are drawn from the population, and are tracked on another day while they stray: "
        "by draws of what the twin takes for its prior and process, for only so is the bound "
        "theirs and is there something to cover. Health above 1 is told as 1.",
        "Intervals: arms commissioned for 25 s with gains known. Covered: with its 95 % interval, "
        "of as many independent joints as scatter like these arms; fail where that excludes "
        "0.87 to 0.93, or of f where the ratio is above 1.06 beyond chance; no verdict where so "
        "few arms do not tell nine tenths from a half. ± is one standard "
        "deviation over arms. NEES: error squared over variance, a direction; of m in those "
        "directions that currents have shown.",
    ]


def _ramps(rows: Sequence[Document]) -> Table:
    heads = (
        "sigma", "rate /\nsigma", "RMSE", "bound", "ratio", "bound, no\nonset", "ratio",
        "bias from\nonset", "after\n18 steps", "paper:\nRMSE", "bias", "verdict",
    )  # fmt: skip
    title = (
        "Friction ramps of 0.0025 a step: ratio to be 1.3 at most, and where sigma is 0.05 at most "
        "the bias after 18 steps within ±1; bias in 0.001"
    )
    table = terminal_table(title, heads)
    for row in rows:
        table.add_row(
            f"{row['sigma']:g}",
            f"{0.0025 / row['sigma']:g}",
            number(row["rmse"]),
            number(row["bound"]),
            f"{row['ratio']:.2f}",
            number(row["bound_onset"]),
            f"{row['rmse'] / row['bound_onset']:.2f}",
            f"{1e3 * row['bias']:+.2f} ± {1e3 * row['bias_error']:.2f}",
            f"{1e3 * row['late_bias']:+.2f} ± {1e3 * row['late_bias_error']:.2f}",
            number(row["paper_rmse"]),
            f"{1e3 * row['paper_bias']:+.0f}",
            "pass" if row["pass"] else "fail",
        )
    return table


def _table_1(rows: Sequence[Document]) -> Table:
    sigmas = [f"{s['sigma']:g}" for s in next(r["scenario"] for r in rows if r["scenario"])]
    heads = ["Table\nI", "paper\nRMSE", "steps"]
    for sigma in sigmas:
        heads += [f"scenario\n{sigma}", "bound", "steps"]
    table = terminal_table("Parameters", (*heads, "arms\nRMSE", "bound", "ratio", "±", "s"))
    for row in rows:
        cells = [row["symbol"], f"{row['rmse']:g}", f"{row['steps']}"]
        for ours in row["scenario"] or [None] * len(sigmas):
            cells += _scenario(ours)
        arm = row["arm"]
        cells += [number(arm["rmse"]), number(arm["bound"])]
        cells += [hundredths(arm["ratio"]), hundredths(arm["ratio_sd"]), _or(arm["converged"])]
        table.add_row(*cells)
    return table


def _scenario(ours: Document | None) -> list[str]:
    if ours is None:
        return [MISSING] * 3
    return [number(ours["rmse"]), number(ours["bound"]), _or(ours["converged"])]


def _table_2(rows: Sequence[Document]) -> Table:
    heads = (
        "Table II", "process", "paper\nRMSE", "ms", "MB", "scenario\nRMSE", "bound", "ratio",
        "arms: f\n[N·m]", "bound", "ms", "p99", "MB",
    )  # fmt: skip
    table = terminal_table("Algorithms: friction, and what an update of the whole arm takes", heads)
    for row in rows:
        ours, arm = row["scenario"], row["arm"]
        paper = [f"{row[f'paper_{k}']:g}" if row.get(f"paper_{k}") else MISSING for k in _PAPER]
        on_arm = (
            [
                number(arm["rmse"]),
                number(arm["bound"]),
                number(1e3 / arm["hz"]),
                number(arm["p99_ms"]),
                f"{arm['mb']:.0f}",
            ]
            if arm
            else [MISSING] * 5
        )
        told = [number(ours["rmse"]), number(ours["bound"]), f"{ours['ratio']:.2f}"]
        table.add_row(row["name"], row["process"], *paper, *told, *on_arm)
    return table


_PAPER = ("rmse", "ms", "mb")


def _table_4(rows: Sequence[Document]) -> Table:
    heads = (
        "Table IV", "paper\nHz", "MB", "ours\nHz", "p50\n[ms]", "p99\n[ms]", "MB", "friction\n[N·m]"
    )  # fmt: skip
    table = terminal_table("Configurations, on the arms", heads)
    for row in rows:
        ours, accuracy = row["ours"], row["accuracy"]
        cells = ["not there yet", *[MISSING] * 4]
        if ours:
            pace = [f"{ours['hz']:.0f}", number(ours["p50_ms"]), number(ours["p99_ms"])]
            cells = [*pace, f"{ours['mb']:.0f}", number(accuracy["rmse"])]
        table.add_row(row["name"], f"{row['hz']:g}", f"{row['mb']:g}", *cells)
    return table


def _truth(arms: Document) -> Table:
    title = (
        f"Intervals of {arms['arms']} {arms['robot']}, {arms['noise']} noise, "
        f"{arms['duration_s']:g} s: nine tenths to be covered"
    )
    heads = ("", "covered", "from", "to", "RMSE /\nbound", "±", "NEES", "±", "verdict")
    table = terminal_table(title, heads)
    for row in arms["groups"]:
        keys = (
            "coverage", "coverage_low", "coverage_high", "ratio", "ratio_sd", "nees", "nees_sd",
        )  # fmt: skip
        verdict = {None: MISSING, True: "pass", False: "fail"}[row["pass"]]
        table.add_row(row["symbol"], *(hundredths(row[key]) for key in keys), verdict)
    nis = (hundredths(arms["nis"]), hundredths(arms["sd"]))
    table.add_row("NIS", *[MISSING] * 5, *nis, MISSING)
    return table


def _or(value: float | None) -> str:
    return MISSING if value is None else f"{value:.3g}"
