"""Old inner modules still lead to their names."""

from __future__ import annotations

import importlib

import pytest

OLD = [
    ("spacearm.momentum.quick", "moving", "spacearm.dynamics.momentum"),
    ("spacearm.momentum", "Momentum", "spacearm.dynamics.momentum"),
    ("spacearm.scene", "Box", "spacearm.geometry.shapes"),
    ("spacearm.scene.enclose.topology", "solid_of", "spacearm.geometry.mesh_topology"),
    ("spacearm.robot.doctor", "diagnose", "spacearm.doctor.examination"),
    ("spacearm.planner", "save_trajectory", "spacearm.files.trajectory_file"),
    ("spacearm.planner.files.plans", "problem_hash", "spacearm.files.plan_file"),
    ("spacearm.motion", "load_trajectory", "spacearm.files.trajectory_file"),
    ("spacearm.proof.digest", "digest", "spacearm.proof.certificate"),
    ("spacearm.checks", "as_readonly", "spacearm.core.checks"),
    ("spacearm.bench.space.collection", "find_problems", "spacearm.study.spacebench"),
]


@pytest.mark.parametrize(("module", "name", "now"), OLD)
def test_an_old_module_leads_to_the_new_place(module: str, name: str, now: str) -> None:
    with pytest.warns(DeprecationWarning, match=rf"{module}\.{name} is now {now}\.{name}"):
        found = getattr(importlib.import_module(module), name)
    assert found is getattr(importlib.import_module(now), name)


@pytest.mark.parametrize("module", ["spacearm.typo", "spacearm.robot.typo", "spacearm.planer"])
def test_what_never_was_is_not_found(module: str) -> None:
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module(module)


def test_a_name_that_never_was_is_none_of_an_old_module() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'movving'"):
        importlib.import_module("spacearm.momentum.quick").movving  # noqa: B018


def test_the_kernels_former_names_lead_to_the_loader() -> None:
    with pytest.warns(DeprecationWarning, match=r"is now spacearm\.core\.native\.available_levels"):
        assert importlib.import_module("spacearm._kernel").available_levels
