"""A browser for tests of pages: Chromium without a window, driven by Playwright."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from spacearm.core.errors import OutputError
from spacearm.report.headless_chromium import find_chromium

ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",  # WebGL by the processor
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


def chromium() -> str:
    """Return the path of Chromium; skip the test if there is none."""
    try:
        return find_chromium()
    except OutputError as error:
        pytest.skip(f"no Chromium: {error}")


@contextmanager
def started_browser() -> Iterator[Any]:
    """Start Chromium; skip the test if it, or Playwright, cannot be had."""
    playwright = pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install playwright")
    path = chromium()
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=list(ARGUMENTS), headless=True)
        try:
            yield browser
        finally:
            browser.close()


class Visit:
    """A page in a window of its own, with what the browser complained of and what it asked the network for.

    Attributes:
        page: Playwright's.
        errors: of the console and of scripts.
        requests: addresses.
    """

    def __init__(self, browser: Any, *, size: tuple[int, int] = (1280, 800), theme: str = "light", touch: bool = False) -> None:
        width, height = size
        self.context = browser.new_context(
            viewport={"width": width, "height": height}, color_scheme=theme, has_touch=touch, reduced_motion="no-preference"
        )
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def open(self, file: Path, part: str = "") -> Visit:
        """Open a report and wait until it is drawn."""
        self.page.goto(file.as_uri() + part)
        self.page.evaluate("spacearm.ready.catch(() => {})")
        self.frame()
        return self

    def frame(self) -> None:
        """Wait until the next two frames are drawn."""
        self.page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def close(self) -> None:
        """Close the window."""
        self.context.close()

    # ---- what a reader sees --------------------------------------------------------------------------------------

    def picture(self) -> bytes:
        """Return the 3-D picture's pixels, as PNG."""
        self.frame()
        url = self.page.evaluate("(spacearm.stage.draw(), document.querySelector('canvas[role=img]').toDataURL())")
        return url.encode()

    def time(self) -> float:
        """Return where the slider stands."""
        return float(self.page.locator(".player input[type=range]").input_value())

    def rect(self, selector: str) -> dict[str, float]:
        """Return the box of the first element that a selector finds, in the window's pixels."""
        script = """(s) => {
            const {x, y, width, height} = document.querySelector(s).getBoundingClientRect();
            return {x, y, width, height}; }"""
        return self.page.evaluate(script, selector)

    def values(self, plot: str) -> dict[str, str]:
        """Return the values beside the labels of a plot's legend."""
        script = """(id) => Object.fromEntries([...document.querySelectorAll(`[data-plot="${id}"] .legend button`)]
            .map((one) => [one.querySelector('.label').textContent, one.querySelector('.value').textContent]))"""
        return self.page.evaluate(script, plot)

    def point_in(self, plot: str, t: float, across: float = 0.5) -> tuple[float, float]:
        """Return the point of the window at a time in a plot whose axis is the whole clock; `across` from the top, 0 to 1."""
        box = self.rect(f'[data-plot="{plot}"] .u-over')
        duration = self.page.evaluate("Number(document.querySelector('.player input').max)")
        return box["x"] + box["width"] * t / duration, box["y"] + box["height"] * across
