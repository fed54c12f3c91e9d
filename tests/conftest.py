"""Put tests/ on the path, so that tests in any room find strategies, oracles and snapshots."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))

# No test is timed: the first one to import Pinocchio or yourdfpy would fail for being first.
settings.register_profile("spacearm", deadline=None)
settings.load_profile("spacearm")
