"""What pages and tables are made of."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from scipy.signal import butter, sosfiltfilt

from urdyn.model.friction import WORKING_SPEED
from urdyn.report.digits import interval90, number
from urdyn.report.evidence import PARTLY, SEEN, UNSEEN, pool, residual, seen
from urdyn.report.identify.comparison import compare, share_inside
from urdyn.report.identify.friction_curve import friction, friction_curve
from urdyn.report.identify.friction_section import friction_section
from urdyn.report.identify.prediction import _spectrum
from urdyn.report.identify.summary import identified as identified_numbers
from urdyn.report.identify.tables import identify_table, truth_table, validate_table
from urdyn.report.names import spoken
from urdyn.report.terminal import terminal_table
from urdyn.report.traces import downsample, spectrum
from urdyn.types import Source


@given(n=st.integers(1, 5000), points=st.integers(4, 600), seed=st.integers(0, 99))
def test_downsampling_keeps_extremes_order_and_budget(n, points, seed):
    x = np.random.default_rng(seed).standard_normal(n)
    index = downsample(x, points)
    assert x[index].max() == x.max() and x[index].min() == x.min()
    assert np.all(np.diff(index) > 0) and len(index) <= max(points, 1)


def test_downsampling_keeps_peaks_beside_missing_samples():
    x = np.zeros(10_000)
    x[::3], x[5_000], x[7_001] = np.nan, 9.0, -9.0
    kept = x[downsample(x, 300)]
    assert np.nanmax(kept) == 9.0 and np.nanmin(kept) == -9.0


def test_the_spectrum_of_white_noise_is_flat_at_its_power():
    rng = np.random.default_rng(3)
    t = np.arange(60_000) / 100.0
    f, density = spectrum(t, rng.standard_normal(len(t)))
    # unit variance over 50 Hz; the mean square of 398 bins of ~140 half-overlapping periodograms
    # scatters by less than 1 %
    assert np.mean(density[2:-2] ** 2) == pytest.approx(1 / 50.0, rel=0.04)
    assert f[-1] == pytest.approx(50.0)


def test_a_spectrum_shows_nothing_far_below_what_is_left_over(case):
    """A filtered current falls by ten decades, whose ticks would cover the axis."""
    low_pass = butter(6, 3.0, fs=100.0, output="sos")
    log = case.seen.log
    smoothed = sosfiltfilt(low_pass, log.channels["actual_current"], axis=0)
    filtered = replace(log, channels={**log.channels, "actual_current": smoothed})
    bare = replace(case.seen, log=filtered)
    _, left = spectrum(log.t, residual(bare)[:, 1])
    drawn = _spectrum(bare, 1)
    low, _ = drawn.layout.yaxis.range
    assert np.log10(min(drawn.data[0].y)) < low - 2.0 and low < np.log10(left.min()) < low + 0.2


def test_a_weekend_between_two_motions_leaves_their_spectrum_as_it_is():
    rng = np.random.default_rng(4)
    t, x = np.arange(6_000) / 100.0, rng.standard_normal(12_000)
    whole, paused = spectrum(t, x[:6_000]), spectrum(np.r_[t, t[:3_000] + 2e5], x[:9_000])
    np.testing.assert_allclose(paused, whole, rtol=1e-6)


@pytest.mark.parametrize(
    ("value", "sd", "words"),
    [
        (12.3456, 0.1, "12.35 ± 0.16"),
        (-0.00004, 0.01, "0.000 ± 0.016"),
        (1234.5, 100.0, "1234 ± 164"),
        (0.5, 0.0, "0.500"),
        (9.96, 0.6053, "10.0 ± 1.0"),
    ],
)
def test_an_interval_has_the_digits_that_it_deserves(value, sd, words):
    assert interval90(value, sd) == words


@pytest.mark.parametrize(
    ("name", "words"),
    [("shoulder_pan_joint", "shoulder pan"), ("base_link_inertia", "base")],
)
def test_a_part_is_spoken_of_without_what_its_drawing_adds(name, words):
    assert spoken(name) == words


def test_numbers_say_when_there_is_none():
    assert [number(float("nan")), number(0.0), number(11.4), number(8.25)] == [
        "–",
        "0",
        "11",
        "8.2",
    ]


def test_a_friction_band_covers_the_truth(case):
    covered = []
    for j, truth in enumerate(case.truth["joints"]):
        v = np.linspace(-1.0, 1.0, 40)
        curve = friction_curve(case.fit, j, v, np.random.default_rng(0))
        true = friction(truth, v)
        assert np.all(curve.low <= curve.torque) and np.all(curve.torque <= curve.high)
        covered.append(np.mean((curve.low <= true) & (true <= curve.high)))
    # A curve has about 3 degrees of freedom, six joints 18: at 90 %, 12 or more are inside in
    # 998 of 1000 cases.
    assert np.mean(covered) >= 12 / 18


def test_most_truths_lie_inside_their_intervals(case):
    found = compare(case.fit, case.truth)
    assert {c.quantity for c in found} >= {"coulomb", "viscous", "mass", "gain"}
    # Correlated quantities: few independent ones. A half would be 4 sd of 20 below 90 %.
    assert share_inside(found) > 0.6


def test_a_log_is_held_out_only_if_no_row_was_trained_on(case):
    trained = case.fit.sources[0]
    assert seen(case.fit, trained) == SEEN
    assert seen(case.fit, replace(trained, rows=(100, 200))) == SEEN
    assert seen(case.fit, replace(trained, rows=(1000, 2000))) == PARTLY
    assert seen(case.fit, replace(trained, rows=None)) == PARTLY
    assert seen(case.fit, replace(trained, rows=(1500, 2000))) == UNSEEN
    assert seen(case.fit, Source("other.csv", "cd" * 32)) == UNSEEN


def test_pooled_scores_lie_between_those_of_the_logs(case):
    pooled = pool(case.fit, case.scores)
    both = np.array([score.rre_percent for score in case.scores])
    assert np.all((both.min(axis=0) <= pooled.ours) & (pooled.ours <= both.max(axis=0)))
    assert not pooled.unseen and pool(case.fit, [case.unseen]).unseen


def test_pooling_leaves_out_what_no_log_tells(case):
    blind = replace(case.seen, target_rre_percent=np.full(6, np.nan))
    assert np.isnan(pool(case.fit, [blind]).controller).all()


def test_tables_render_whatever_a_log_is_called(case):
    source = Source("[red]odd[b].csv", "ab" * 32, (0, 1500))
    odd = replace(case.seen, log=replace(case.seen.log, source=source))
    console = Console(width=160, record=True, file=StringIO())
    console.print(identify_table(case.fit))
    console.print(validate_table([odd], case.fit))
    console.print(truth_table(case.fit, case.truth))
    shown = console.export_text()
    assert "[red]odd[b].csv" in shown
    for words in ("shoulder pan", "sensor floor", "upper arm", "±", "yes"):
        assert words in shown


def test_friction_is_told_as_tracking_tells_it_and_not_by_terms_that_trade_off(case):
    """Nor at rest, where a constraint may hold it at none at all."""
    fit, pan = case.fit, "shoulder_pan_joint"
    drive = fit.dynamics.drive
    g = -float(drive.coulomb[0])
    at = fit.parameters.names.index(f"{pan}.stribeck")
    values = np.where(np.arange(len(fit.parameters)) == at, g, fit.parameters.values)
    stribeck = np.where(np.arange(6) == 0, g, drive.stribeck)
    dynamics = replace(fit.dynamics, drive=replace(drive, stribeck=stribeck))
    terms = (frozenset({"stribeck"}), *fit.terms[1:])
    parameters = replace(fit.parameters, values=values)
    fit = replace(fit, dynamics=dynamics, parameters=parameters, terms=terms)
    pan_row = [str(next(iter(column.cells))) for column in identify_table(fit).columns]
    whole = fit.friction(WORKING_SPEED)
    mean, sd = float(whole.mean[0]), float(whole.sd[0])
    assert fit.friction(0.0).mean[0] == 0.0 < mean
    assert pan_row[1] == interval90(mean, sd)
    assert interval90(mean, sd) in friction_section(fit, [], None)
    for words in (pan_row[-1], friction_section(fit, [], None)):
        assert f"builds up by {number(-g)} N·m" in words
    told = identified_numbers(fit, 1.0)["joints"][0]["friction"]
    assert told == {"value": mean, "sd": sd, "unit": "N·m"}


def test_every_truth_that_is_counted_is_printed(case):
    assert truth_table(case.fit, case.truth).row_count == len(compare(case.fit, case.truth))


def test_tables_render_whatever_an_arm_is_called(case):
    """Of `[/x]` rich takes the end of a style that never began."""
    dynamics = case.fit.dynamics
    named = replace(dynamics, arm=replace(dynamics.arm, name="ur[/x]"))
    cells = ["[red]a", "b[/y]"]
    console = Console(width=160, record=True, file=StringIO())
    console.print(identify_table(replace(case.fit, dynamics=named)))
    console.print(terminal_table("", cells, [cells]))
    shown = console.export_text()
    assert "UR[/x]: estimates" in shown
    assert all(shown.count(cell) == 2 for cell in cells)


@pytest.mark.parametrize("width", [60, 80])
def test_a_narrow_terminal_shows_every_digit(case, width):
    console = Console(width=width, record=True, file=StringIO())
    console.print(identify_table(case.fit), validate_table([case.seen], case.fit))
    console.print(truth_table(case.fit, case.truth))
    assert "…" not in console.export_text()
