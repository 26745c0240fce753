"""A headless Chromium, spoken to by its DevTools protocol over a pipe: no port, no driver."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-background-networking", "--disable-dev-shm-usage",
    "--hide-scrollbars", "--no-first-run", "--remote-debugging-pipe",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # a page needs nobody else
)  # fmt: skip
DEADLINE = 60.0  # [s] for one answer
DRAWN = """document.querySelector(".plot") === null
  || document.documentElement.dataset.drawn === "all" """
COMPLAINTS = ("Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled")

# What a reader would miss: plots without a drawing or a mark in it, and parts beyond the page.
LOOK = """(() => {
  const wide = document.documentElement.clientWidth;
  const inside = (e) => e.closest(".scroll, svg, .js-plotly-plot");
  const box = (e) => e.getBoundingClientRect();
  const drawn = (p) => p.querySelector(".main-svg") && box(p).width > 100 && box(p).height > 100
    && p.querySelectorAll(".scatterlayer path, .barlayer path, .scatterlayer .text").length > 0;
  const plots = [...document.querySelectorAll(".plot")];
  return JSON.stringify({
    plots: plots.length,
    empty: plots.filter((p) => !drawn(p)).map((p) => p.parentNode.innerText.slice(0, 80)),
    overflow: document.documentElement.scrollWidth - wide,
    wide: [...document.querySelectorAll("main *")]
      .filter((e) => !inside(e) && box(e).right > wide + 1)
      .map((e) => `${e.tagName} ${e.className} ${e.textContent.slice(0, 40)}`),
    sections: [...document.querySelectorAll("h2")].map((e) => e.textContent),
    ink: getComputedStyle(document.body).color,
    paper: getComputedStyle(document.body).backgroundColor,
  });
})()"""


class Browser:
    """One page at a time."""

    def __init__(self, inbox: int, outbox: int) -> None:
        self._inbox, self._outbox, self._buffer, self._count = inbox, outbox, b"", 0
        self.complaints: list[str] = []
        self.drawn = 0.0  # [s] until the last plot of the open page was drawn
        self._session = ""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")

    def open(self, page: Path | str, width: int = 1280, scheme: str = "light") -> float:
        """Load a page, wait until all of it is drawn; after how long it could be read [s]."""
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.ask("Emulation.setEmulatedMedia", media="screen", features=features)
        self.complaints.clear()
        started = time.perf_counter()
        self.ask("Page.navigate", url=page if isinstance(page, str) else page.as_uri())
        self._until("Page.loadEventFired")
        took = time.perf_counter() - started
        while self.evaluate(DRAWN) is False:
            assert time.perf_counter() - started < DEADLINE, "it is never drawn"
            time.sleep(0.05)
        self.drawn = time.perf_counter() - started
        return took

    def look(self) -> dict[str, Any]:
        """What `LOOK` sees of the open page."""
        return json.loads(self.evaluate(LOOK))

    def evaluate(self, expression: str) -> Any:
        """The value of an expression on the page."""
        return self.ask("Runtime.evaluate", expression=expression)["result"].get("value")

    def picture(self, path: Path, **clip: float) -> None:
        """The whole page as PNG, or what `clip` (x, y, width, height) says of it."""
        if not clip:
            size = self.ask("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"x": 0, "y": 0, "width": size["width"], "height": size["height"]}
        how = {"captureBeyondViewport": True, "clip": {**clip, "scale": 1}}
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", **how)["data"]))

    def printed(self) -> bytes:
        """The page as PDF."""
        return base64.b64decode(self.ask("Page.printToPDF", printBackground=True)["data"])

    def ask(self, method: str, **params: Any) -> dict[str, Any]:
        """One command and its result."""
        self._count += 1
        command = {"id": self._count, "method": method, "params": params}
        told = command | ({"sessionId": self._session} if self._session else {})
        os.write(self._outbox, json.dumps(told).encode() + b"\0")
        while (answer := self._next()).get("id") != self._count:
            pass
        assert "error" not in answer, f"{method}: {answer['error']}"
        return answer["result"]

    def _until(self, event: str) -> None:
        while self._next().get("method") != event:
            pass

    def _next(self) -> dict[str, Any]:
        deadline = time.monotonic() + DEADLINE
        while b"\0" not in self._buffer:
            left = deadline - time.monotonic()
            assert left > 0.0 and select.select([self._inbox], [], [], left)[0], (
                "it does not answer"
            )
            self._buffer += os.read(self._inbox, 1 << 20)
        message, _, self._buffer = self._buffer.partition(b"\0")
        told: dict[str, Any] = json.loads(message)
        if told.get("method") in COMPLAINTS:
            self.complaints.append(json.dumps(told["params"])[:400])
        return told


@contextmanager
def browser(profile: Path) -> Iterator[Browser]:
    """A Chromium that lives as long as the context."""
    assert CHROMIUM is not None
    ours_in, its_out = os.pipe()
    its_in, ours_out = os.pipe()

    def wire() -> None:
        """It reads commands from 3 and writes answers to 4."""
        spare_in, spare_out = os.dup(its_in), os.dup(its_out)
        os.dup2(spare_in, 3)
        os.dup2(spare_out, 4)

    command = [CHROMIUM, *FLAGS, f"--user-data-dir={profile}"]
    process = subprocess.Popen(command, preexec_fn=wire, close_fds=False, stderr=subprocess.DEVNULL)
    os.close(its_in)
    os.close(its_out)
    try:
        yield Browser(ours_in, ours_out)
    finally:
        process.kill()
        process.wait()
        os.close(ours_in)
        os.close(ours_out)
