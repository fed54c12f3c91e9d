"""The stub that types the compiled kernel in Python says what the kernel binds, at every level."""

from __future__ import annotations

import runpy

import pytest

from house.source import PACKAGE, REPOSITORY
from kernel.builds import LEVELS
from spacearm.core.native import available_levels, load_level
from spacearm.core.native_finder import native_finder

pytest.importorskip("nanobind.stubgen", reason="the kernel was built in another environment")
TOOL = runpy.run_path(str(REPOSITORY / "tools" / "kernel_stub.py"))
STUB, FINDER_STUB = ((PACKAGE / "_kernel" / name).read_text(encoding="utf-8") for name in ("kernel.pyi", "_proof.pyi"))


@pytest.mark.parametrize("level", LEVELS)
def test_the_stub_is_what_the_kernel_binds(level: str) -> None:
    """Otherwise run tools/kernel_stub.py."""
    if level not in available_levels():
        pytest.skip(f"this processor does not run {level}")
    if TOOL["WRITTEN"] not in STUB:
        pytest.skip("the stub was written with another version of nanobind")
    assert TOOL["stub_of"](load_level(level)) == STUB


def test_the_stub_of_the_finder_is_what_it_binds() -> None:
    """Otherwise run tools/kernel_stub.py."""
    if TOOL["WRITTEN"] not in FINDER_STUB:
        pytest.skip("the stub was written with another version of nanobind")
    assert TOOL["stub_of"](native_finder, TOOL["PROOF_HEADER"]) == FINDER_STUB
