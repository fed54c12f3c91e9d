"""What the compiler made of the kernel: packed arithmetic of the full width, and no instruction that changes a bit."""

from __future__ import annotations

import bisect
import re
import shutil
import subprocess
from collections import Counter
from functools import cache
from typing import NamedTuple

import pytest

from kernel.builds import LEVELS
from spacearm._kernel import available_levels, load_level

pytestmark = pytest.mark.skipif(shutil.which("objdump") is None, reason="objdump is missing")

# The level's widest registers, and those that it does not have.
WIDEST = {"x86-64-v4": "zmm", "x86-64-v3": "ymm", "x86-64-v2": "xmm"}
LACKING = {"x86-64-v3": "zmm", "x86-64-v2": "[yz]mm", "generic": "[yz]mm"}
ARITHMETIC = re.compile(r"v?(add|sub|mul|div|sqrt|min|max|round|rndscale)(ps|pd|ss|sd)")


class Instruction(NamedTuple):
    """An operation, its operands, and where it stands."""

    address: int
    name: str
    operands: str


def printed(level: str, *options: str) -> str:
    """What objdump says about a level's module, which it does not have to run."""
    if level not in available_levels():
        pytest.skip(f"this processor does not run {level}, so its module is not imported to be found")
    command = ["objdump", *options, str(load_level(level).__file__)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@cache
def instructions(level: str) -> list[Instruction]:
    line = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(.*)$", re.M)
    lines = line.findall(printed(level, "-d", "--no-show-raw-insn"))
    return [Instruction(int(address, 16), name, operands) for address, name, operands in lines]


@cache
def functions(level: str) -> list[list[Instruction]]:
    """The instructions by function: symbols are stripped, but the frames for unwinding tell where each begins."""
    ranges = re.findall(r"FDE cie=\S+ pc=([0-9a-f]+)\.\.", printed(level, "--dwarf=frames"))
    begins = sorted({int(begin, 16) for begin in ranges})
    found: list[list[Instruction]] = [[] for _ in range(len(begins) + 1)]
    for instruction in instructions(level):
        found[bisect.bisect_right(begins, instruction.address)].append(instruction)
    return found[1:]


class Function(NamedTuple):
    """The arithmetic of one function: how often each operation is packed, and scalar, and in which registers."""

    packed: Counter[str]
    scalar: Counter[str]
    registers: set[str]
    kinds: set[str]


def summed_up(body: list[Instruction]) -> Function:
    packed, scalar, registers, kinds = Counter[str](), Counter[str](), set[str](), set[str]()
    for instruction in body:
        match = ARITHMETIC.fullmatch(instruction.name)
        if not match:
            continue
        operation, kind = match.groups()
        (packed if kind.startswith("p") else scalar)[operation] += 1
        if kind.startswith("p"):
            kinds.add(kind)
            registers.update(re.findall(r"%([xyz]mm)", instruction.operands))
    return Function(packed, scalar, registers, kinds)


def evaluations(level: str) -> list[Function]:
    """The functions that measure distances: they alone take packed roots, and compare with packed min and max."""
    found = [summed_up(body) for body in functions(level)]
    return [f for f in found if f.packed["sqrt"] and f.packed["min"] and f.packed["max"]]


@pytest.mark.parametrize("level", WIDEST)
def test_every_objective_is_evaluated_in_packs(level: str) -> None:
    """Objectives, evaluated and searched, and clearances of every shape: a dozen functions a scalar, if none is inlined."""
    kinds = Counter(kind for f in evaluations(level) for kind in f.kinds)
    assert kinds["pd"] >= 4
    assert kinds["ps"] >= 4


@pytest.mark.parametrize("level", WIDEST)
def test_evaluations_use_the_widest_registers(level: str) -> None:
    for f in evaluations(level):
        assert WIDEST[level] in f.registers


@pytest.mark.parametrize("level", WIDEST)
def test_no_root_minimum_or_maximum_of_an_evaluation_is_taken_apart_into_scalars(level: str) -> None:
    for f in evaluations(level):
        # A search reads the clock, its limits and a tree's lengths in scalars: a handful of operations, and no loop over lanes.
        assert f.scalar["sqrt"] <= 1
        assert f.scalar["min"] + f.scalar["max"] <= 2
        assert f.scalar.total() < f.packed.total()


@pytest.mark.parametrize("level", WIDEST)
def test_angles_are_rounded_in_packs(level: str) -> None:
    """`nearest` of the sine's reduction, in float and in double, in the widest registers."""
    packed = Counter[str]()
    for instruction in instructions(level):
        match = ARITHMETIC.fullmatch(instruction.name)
        if match and match[1] in ("round", "rndscale"):
            packed[match[2]] += f"%{WIDEST[level]}" in instruction.operands
    assert packed["ps"] >= 2
    assert packed["pd"] >= 2


@pytest.mark.parametrize("level", WIDEST)
def test_roots_are_packed_but_for_those_of_single_numbers(level: str) -> None:
    whole = Counter[str]()
    for body in functions(level):
        f = summed_up(body)
        whole["packed"] += f.packed["sqrt"]
        whole["scalar"] += f.scalar["sqrt"]
    # Scalar ones where there is a single number to take it of: the way between two configurations or two places of the
    # hand, a motion's duration, the turns of a base, and where a model is made.
    assert whole["scalar"] < whole["packed"]


@pytest.mark.parametrize("level", LEVELS)
def test_no_level_fuses_a_product_into_a_sum(level: str) -> None:
    """A fused multiply-add rounds once instead of twice, and so differs from a level that has none."""
    fused = Counter(i.name for i in instructions(level) if re.match(r"vfn?m(add|sub)", i.name))
    assert not fused


@pytest.mark.parametrize("level", LEVELS)
def test_no_level_approximates_a_root_or_a_quotient(level: str) -> None:
    rough = Counter(i.name for i in instructions(level) if re.match(r"v?r(sqrt|cp)(14|28)?[ps][sd]$", i.name))
    assert not rough


@pytest.mark.parametrize("level", LACKING)
def test_a_level_keeps_to_its_registers(level: str) -> None:
    beyond = [i for i in instructions(level) if re.search(rf"%{LACKING[level]}", i.operands)]
    assert not beyond


@pytest.mark.parametrize("level", ["x86-64-v2", "generic"])
def test_levels_before_avx_have_no_avx_encoding(level: str) -> None:
    """No instruction of the newer levels' code was linked in."""
    assert not [i for i in instructions(level) if re.match(r"v(add|sub|mul|div|mov|sqrt|xor)[a-z]*[ps][sd]", i.name)]
