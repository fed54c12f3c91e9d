"""Put tests/ on the path, so that tests in any room find strategies, oracles and snapshots."""

import atexit
import os
import shutil
import signal
import sys
import tempfile
from pathlib import Path

from hypothesis import HealthCheck, settings

sys.path.insert(0, str(Path(__file__).parent))

# The workers share the processor's cores: none may take all of them for a product of small matrices.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The tests leave the user's cache alone. The workers share one, and get its name from the process that starts them.
if "SPACEARM_CACHE" not in os.environ:
    os.environ["SPACEARM_CACHE"] = tempfile.mkdtemp(prefix="spacearm-cache-")
    atexit.register(shutil.rmtree, os.environ["SPACEARM_CACHE"], ignore_errors=True)

# A shell that runs the tests in the background lets them ignore Ctrl-C, and the programs that they start too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# No test is timed: the first one to import Pinocchio or trimesh would fail for being first. Other inputs are drawn each time,
# so that many runs see what a long one would; pytest --hypothesis-profile=thorough draws ten times as many at once.
UNHURRIED: list[HealthCheck] = [HealthCheck.too_slow]  # a busy machine draws slowly
settings.register_profile("spacearm", deadline=None, max_examples=25, suppress_health_check=UNHURRIED)
# CI draws the same inputs each time, so that a change is judged and not chance; everybody else draws new ones.
settings.register_profile("ci", deadline=None, max_examples=25, suppress_health_check=UNHURRIED, derandomize=True)
settings.register_profile("thorough", deadline=None, max_examples=250, suppress_health_check=UNHURRIED)
settings.load_profile("ci" if os.environ.get("CI") == "true" else "spacearm")
