"""The yardstick computes what the kernel computes, so that their times may be compared."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from house.source import PACKAGE
from spacearm.study import reference_core
from spacearm.study.numpy_reference import LOWER, UPPER, by_matrices
from spacearm.study.paper_problem import PaperSettings, paper_objective


@pytest.mark.parametrize("mode", ["goal", "literal"])
def test_it_says_what_the_kernel_says(mode: str) -> None:
    q = np.random.default_rng(0).uniform(LOWER, UPPER, (200, 7))
    expected = paper_objective(PaperSettings(), mode, 0.10).evaluate(q)
    for value, reference in zip(by_matrices(q, mode), expected, strict=True):  # type: ignore[arg-type]
        np.testing.assert_allclose(value, reference, rtol=0, atol=1e-12)  # sums of some 20 lengths near 1 m


def test_it_keeps_the_number_type() -> None:
    q = np.zeros((3, 7), np.float32)
    assert all(value.dtype == np.float32 for value in by_matrices(q))


def test_it_needs_numpy_only() -> None:
    program = (
        f"import sys; sys.path[:0] = [{str(PACKAGE.parent)!r}]; import spacearm.study.numpy_reference; "
        "print([name for name in sys.modules if name.startswith('spacearm')])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    own = {
        "spacearm",
        "spacearm.core",
        "spacearm.core.moved",
        "spacearm.core.notebook_hook",
        "spacearm.study",
        "spacearm.study.numpy_reference",
    }
    assert set(eval(done.stdout)) == own


def test_a_slower_core_is_scaled_down(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference_core, "seconds_per_configuration", lambda: 2 * reference_core.REFERENCE)
    assert reference_core.scale_now() == 0.5
