from __future__ import annotations

import pytest

from kernel.builds import BUILDS, Build
from spacearm.core.native import available_levels


@pytest.fixture(scope="session", params=BUILDS, ids=str)
def build(request: pytest.FixtureRequest) -> Build:
    """Every build of the kernel in turn; those that this machine cannot run are skipped."""
    if request.param.level not in available_levels():
        pytest.skip(f"this processor does not run {request.param.level}")
    return request.param
