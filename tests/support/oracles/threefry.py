"""Threefry-4x32-20 by randomgen: the one place where keys and counters are converted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from randomgen import ThreeFry


def words(key: Sequence[int], counter: Sequence[int]) -> np.ndarray:
    """The four random words (4,) of a key and a counter of four words each, least significant first."""
    # randomgen counts before it draws, so it is set one back.
    before = (_joined(counter) - 1) % 2**128
    generator = ThreeFry(key=_joined(key), counter=before, number=4, width=32)
    return generator.random_raw(4).astype(np.uint32)


def _joined(four: Sequence[int]) -> int:
    return sum(int(word) << (32 * i) for i, word in enumerate(four))
