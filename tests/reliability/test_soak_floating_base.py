"""A share of benchmarks/soak_floating_base.py: certificates of floating bases, confirmed by a checker of its own."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spacearm.proof import certify
from support.floating_cases import drawn
from support.floating_checker import complaints


@pytest.mark.parametrize("block", range(3))
def test_what_is_said_of_a_drawn_floating_base_is_so(block: int) -> None:
    statuses = set()
    for number in range(10 * block, 10 * block + 10):
        case, trajectory, way = drawn(7, number)
        certificate = certify(case, trajectory, limits=())
        statuses.add(certificate.status)
        assert not complaints(case, trajectory, way, certificate), number
    assert {"holds", "fails"} <= statuses


def test_the_checker_sees_what_is_wrong() -> None:
    number = next(i for i in range(50) if certify(*drawn(7, i)[:2], limits=()).holds)
    case, trajectory, way = drawn(7, number)
    certificate = certify(case, trajectory, limits=())
    assert certificate.base_findings is not None
    bold = replace(certificate, clearance=(certificate.clearance or 0.0) * 3 + 1e-3)
    assert complaints(case, trajectory, way, bold)
    quick = replace(certificate, base_findings=replace(certificate.base_findings, rate=certificate.base_findings.rate * 0.99))
    assert complaints(case, trajectory, way, quick)
