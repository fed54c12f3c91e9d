"""Make the pictures of the README from real reports: python tools/pictures.py (needs Chromium, ffmpeg and the test extra).

They go into docs/figures: report.png and report_swarm.png are windows of pages, report.gif is a plan's picture, played.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FIGURES = ROOT / "docs" / "figures"
sys.path.insert(0, str(ROOT / "tests"))


def spacearm(*words: object) -> None:
    """Run a command of spacearm's."""
    subprocess.run([sys.executable, "-m", "spacearm.cli", *map(str, words)], check=True, cwd=ROOT)


def window(page: Path, out: Path, *, dark: bool, at: float) -> None:
    """Save a window of a report."""
    from playwright.sync_api import sync_playwright

    from support.browser import ARGUMENTS, chromium

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(ARGUMENTS))
        tab = browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme="dark" if dark else "light")
        tab.goto(page.as_uri())
        tab.evaluate("window.spacearm.ready")
        tab.evaluate(f"window.spacearm.seek({at})")
        tab.wait_for_timeout(1000)
        tab.screenshot(path=str(out))
        browser.close()


def main() -> None:
    """Make the three pictures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        spacearm("plan", "examples/07_box_servicer.yaml", "-o", folder / "servicer", "--seed", 0)
        spacearm("paper", "-o", folder / "paper", "--modes", "goal")
        window(folder / "servicer" / "report.html", FIGURES / "report.png", dark=False, at=41)
        window(folder / "paper" / "report.html", FIGURES / "report_swarm.png", dark=True, at=12)
        film = folder / "report.gif"
        spacearm("report", folder / "servicer" / "plan.json", "--video", film, "--size", "720x440", "--fps", 10, "--speed", 8)
        (FIGURES / "report.gif").write_bytes(film.read_bytes())
    for picture in ("report.png", "report_swarm.png", "report.gif"):
        print(f"docs/figures/{picture}: {(FIGURES / picture).stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
