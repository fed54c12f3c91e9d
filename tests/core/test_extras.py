"""Libraries of the extras: what needs one that is missing says so, and how to install it, before any work is done."""

from __future__ import annotations

import sys
from importlib import util
from pathlib import Path

import pytest

import spacearm as sa
from spacearm.core import extras
from spacearm.core.errors import SettingsError

if sys.version_info >= (3, 11):
    import tomllib
else:
    from pip._vendor import tomli as tomllib

PYPROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch):
    """Return a function that makes libraries look as if they were not installed."""
    found = util.find_spec

    def hide(*names: str) -> None:
        monkeypatch.setattr(extras, "find_spec", lambda name: None if name in names else found(name))

    return hide


def test_every_library_of_an_extra_is_in_that_extra() -> None:
    known = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for module, extra in extras._EXTRAS.items():
        assert any(requirement.startswith(module) for requirement in known[extra])


def test_a_time_optimal_plan_without_its_library_is_refused_before_the_search(without) -> None:
    without("toppra")
    robot = sa.load_robot("zhang2022")
    problem = sa.Problem(robot, sa.Scene([]), start=[0] * 7, goal=sa.ConfigurationGoal([0.3] * 7))
    with pytest.raises(SettingsError, match=r"toppra, which is not installed; pip install 'spacearm\[time-optimal\]'"):
        sa.plan(problem, sa.PlannerSettings(time_law="time_optimal"), rng=0)
    with pytest.raises(SettingsError, match="toppra"):
        sa.time_optimal(robot, sa.Motion([[0] * 7, [0.3] * 7]))
    assert sa.plan(problem, rng=0).found


def test_what_is_installed_is_not_imported_to_be_found() -> None:
    before = set(sys.modules)
    assert extras.has_extra("json")
    assert set(sys.modules) == before
