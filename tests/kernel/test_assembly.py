"""What the compiler made of the kernel: no instruction that changes a bit, and none that the level does not have."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from typing import NamedTuple

import pytest

from kernel.builds import LEVELS
from spacearm.core.native import available_levels, load_level

pytestmark = pytest.mark.skipif(shutil.which("objdump") is None, reason="objdump is missing")

# The registers that a level does not have.
LACKING = {"x86-64-v3": "zmm", "x86-64-v2": "[yz]mm", "generic": "[yz]mm"}


class Instruction(NamedTuple):
    """An operation and its operands."""

    name: str
    operands: str


@cache
def instructions(level: str) -> list[Instruction]:
    """What objdump says about a level's module."""
    if level not in available_levels():
        pytest.skip(f"this processor does not run {level}, so its module is not imported to be found")
    command = ["objdump", "-d", "--no-show-raw-insn", str(load_level(level).__file__)]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [Instruction(name, operands) for name, operands in re.findall(r"^\s*[0-9a-f]+:\t(\S+)(.*)$", text, re.M)]


@pytest.mark.parametrize("level", LEVELS)
def test_no_level_fuses_a_product_into_a_sum(level: str) -> None:
    """A fused multiply-add rounds once instead of twice, and so differs from a level that has none."""
    fused = {i.name for i in instructions(level) if re.match(r"vfn?m(add|sub)", i.name)}
    assert not fused


@pytest.mark.parametrize("level", LEVELS)
def test_no_level_approximates_a_root_or_a_quotient(level: str) -> None:
    rough = {i.name for i in instructions(level) if re.match(r"v?r(sqrt|cp)(14|28)?[ps][sd]$", i.name)}
    assert not rough


@pytest.mark.parametrize("level", LACKING)
def test_a_level_keeps_to_its_registers(level: str) -> None:
    beyond = [i for i in instructions(level) if re.search(rf"%{LACKING[level]}", i.operands)]
    assert not beyond


@pytest.mark.parametrize("level", ["x86-64-v2", "generic"])
def test_levels_before_avx_have_no_avx_encoding(level: str) -> None:
    """No instruction of a newer level's code was linked in."""
    assert not [i for i in instructions(level) if re.match(r"v(add|sub|mul|div|mov|sqrt|xor)[a-z]*[ps][sd]", i.name)]
