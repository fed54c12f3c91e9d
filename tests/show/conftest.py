"""Figures in fewer dots, for tests that look at the file and not at the picture."""

from __future__ import annotations

import pytest


@pytest.fixture
def few_dots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let PNG files have a fiftieth of the dots."""
    monkeypatch.setattr("spacearm.show.figure_style.DPI", 40)
