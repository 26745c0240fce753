"""A real browser draws the page."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from urdyn.report.page import identify_page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_a_browser_draws_every_plot_without_complaint(case, tmp_path):
    page = tmp_path / "report.html"
    page.write_text(identify_page(case.fit, case.scores, 2.5, case.truth), encoding="utf-8")
    done = subprocess.run(
        [
            CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader", "--disable-background-networking",
            "--disable-dev-shm-usage", f"--user-data-dir={tmp_path / 'profile'}",
            "--virtual-time-budget=20000", "--enable-logging=stderr", "--dump-dom", page.as_uri(),
        ],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert "CONSOLE" not in done.stderr
    canvases = re.findall(r'<div class="plot js-plotly-plot".*?</figure>', done.stdout, re.S)
    assert len(canvases) == page.read_text(encoding="utf-8").count('class="plot"') > 20
    assert all("main-svg" in canvas for canvas in canvases)
