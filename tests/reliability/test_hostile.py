"""A share of benchmarks/fuzz_arguments.py: no argument of the public face, however absurd, ends in anything but a sentence."""

from __future__ import annotations

import signal

import pytest

from support.hostile_calls import CALLS, finding, hostile_call

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="timers of POSIX")


@pytest.mark.parametrize("name", CALLS)
def test_the_calls_to_begin_with_are_fine(name: str) -> None:
    assert finding(name, {}) == ("fine", "")


@pytest.mark.parametrize("number", range(150))
def test_an_absurd_argument_gives_a_result_or_one_sentence(number: int) -> None:
    name, changed = hostile_call((1, number))
    kind, details = finding(name, changed)
    assert kind in ("fine", "refused"), (name, changed, details)
