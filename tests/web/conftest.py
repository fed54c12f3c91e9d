"""The browser of a module, and the pages that it looks at."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from support.browser import Visit, started_browser
from support.small_report import small_report


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    # Of a module, not of the session: while Playwright runs, asyncio is taken.
    with started_browser() as browser:
        yield browser


@pytest.fixture
def visit(browser: Any) -> Iterator[Callable[..., Visit]]:
    """Open windows with `visit(size=..., theme=..., touch=...)`; they are closed at the end."""
    opened: list[Visit] = []

    def begin(**options: Any) -> Visit:
        opened.append(Visit(browser, **options))
        return opened[-1]

    yield begin
    for one in opened:
        one.close()


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page written by hand."""
    from spacearm.report.report_page import write_report

    path = tmp_path_factory.mktemp("small") / "report.html"
    write_report(small_report(), path)
    return path
