"""Seeds: what `rng` may be, and the one number a run is repeated from."""

from __future__ import annotations

import secrets
from typing import TypeAlias

import numpy as np

from spacearm.core.checks import shown
from spacearm.core.errors import SettingsError

Rng: TypeAlias = int | np.random.Generator | None
"""A seed (0 is one), a generator a seed is drawn from, or None for a fresh seed, which the result records."""

_BITS = 63  # so that a seed fits every format's integer


def seed_of(rng: Rng) -> int:
    """Return the seed that `rng` stands for.

    Raises:
        SettingsError: not a seed from 0 to 2^63 - 1, a generator, or None.
    """
    if rng is None:
        return secrets.randbits(_BITS)
    if isinstance(rng, np.random.Generator):
        return int(rng.integers(0, 2**_BITS))
    if isinstance(rng, (int, np.integer)) and not isinstance(rng, bool) and 0 <= int(rng) < 2**_BITS:
        return int(rng)
    raise SettingsError(f"rng is {shown(rng)}, expected a seed from 0 to 2^63 - 1, a numpy.random.Generator, or None")
