"""The kernel's random numbers against randomgen's Threefry, Random123's published answers, and what chance allows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from kernel.builds import Build
from support.oracles import threefry

WORDS = st.integers(0, 2**32 - 1)
ONES = [2**32 - 1] * 4
# Random123's kat_vectors: threefry4x32, 20 rounds.
KNOWN_ZEROS = [0x9C6CA96A, 0xE17EAE66, 0xFC10ECD4, 0x5256A7D8]
KNOWN_ONES = [0x2A881696, 0x57012287, 0xF6C7446E, 0xA16A6732]

FALSE_ALARMS = 1e-6  # for every statistical test below, were its seeds drawn anew
PURPOSES = {"start position": 0, "start velocity": 1, "velocity": 2, "evolution": 3, "archive": 4}


def as_words(build: Build, uniforms: np.ndarray) -> np.ndarray:
    """The random words, or in float their upper 24 bits, that the numbers were made of."""
    scaled = uniforms.astype(np.float64) * (2.0**32 if build.bits == 64 else 2.0**24)
    whole = scaled.astype(np.uint64)
    np.testing.assert_array_equal(whole, scaled)
    return whole


def expected(build: Build, word: np.ndarray) -> np.ndarray:
    return word.astype(np.uint64) if build.bits == 64 else word.astype(np.uint64) >> np.uint64(8)


def sample(build: Build, particles: int, *, seed: int = 0, trial: int = 0, purpose: int = 2, iteration: int = 0) -> np.ndarray:
    """The four numbers of each particle (4, particles) of block 0."""
    draw = build.named("uniforms")
    packs = [draw(seed, trial, purpose, iteration, first, 0) for first in range(0, particles, build.drawn_together)]
    return np.concatenate(packs, axis=1)[:, :particles]


def test_the_oracle_is_threefry_4x32_with_20_rounds() -> None:
    np.testing.assert_array_equal(threefry.words([0] * 4, [0] * 4), KNOWN_ZEROS)
    np.testing.assert_array_equal(threefry.words(ONES, ONES), KNOWN_ONES)


def test_key_and_counter_zero_give_the_published_words(build: Build) -> None:
    first = build.named("uniforms")(0, 0, 0, 0, 0, 0)[:, 0]
    np.testing.assert_array_equal(as_words(build, first), expected(build, np.array(KNOWN_ZEROS)))


@settings(max_examples=20)
@given(st.integers(0, 2**64 - 1), WORDS, WORDS, WORDS, WORDS, WORDS)
def test_every_word_is_threefrys(
    build: Build, seed: int, trial: int, purpose: int, iteration: int, first: int, block: int
) -> None:
    found = build.named("uniforms")(seed, trial, purpose, iteration, first, block)
    assert found.shape == (4, build.drawn_together)
    assert found.dtype == build.scalar
    key = [seed % 2**32, seed >> 32, trial, purpose]
    for lane in range(build.drawn_together):
        words = threefry.words(key, [(first + lane) % 2**32, iteration, block, 0])
        np.testing.assert_array_equal(as_words(build, found[:, lane]), expected(build, words))


def test_all_ones_are_no_exception(build: Build) -> None:
    """A carry that is lost shows here. The kernel's last counter word is always 0."""
    found = build.named("uniforms")(2**64 - 1, *[2**32 - 1] * 5)[:, 0]
    words = threefry.words(ONES, [*ONES[:3], 0])
    np.testing.assert_array_equal(as_words(build, found), expected(build, words))


def test_a_particles_numbers_do_not_depend_on_the_pack_it_is_in(build: Build) -> None:
    draw = build.named("uniforms")
    whole = np.concatenate([draw(5, 1, 2, 3, first, 4) for first in range(0, 64, build.drawn_together)], axis=1)
    for first in range(64 - build.drawn_together):
        np.testing.assert_array_equal(draw(5, 1, 2, 3, first, 4), whole[:, first : first + build.drawn_together])


def test_numbers_are_in_the_half_open_unit_interval(build: Build) -> None:
    """No word can become 1: the largest one is the nearest number below it on the grid."""
    numbers = sample(build, 20_000)
    assert numbers.min() >= 0
    assert numbers.max() < 1
    top = 2**32 - 1 if build.bits == 64 else 2**24 - 1
    assert build.scalar(top) * build.scalar(2.0 ** -(32 if build.bits == 64 else 24)) < 1


@pytest.mark.parametrize("purpose", PURPOSES.values(), ids=PURPOSES.keys())
def test_numbers_are_uniform(build: Build, purpose: int) -> None:
    numbers = sample(build, 20_000, seed=11, purpose=purpose).astype(np.float64)
    for word in numbers:
        assert stats.kstest(word, "uniform").pvalue > FALSE_ALARMS / numbers.shape[0]


@pytest.mark.parametrize("change", [{"seed": 8}, {"seed": 7 + 2**32}, {"trial": 1}, {"purpose": 3}, {"iteration": 1}], ids=str)
def test_other_seeds_trials_purposes_and_rounds_have_numbers_of_their_own(build: Build, change: dict[str, int]) -> None:
    """Neighbours are the hardest: their keys or counters differ in one bit."""
    n = 20_000
    one, other = sample(build, n, seed=7), sample(build, n, **{"seed": 7, **change})
    # Equal words are rare, and the correlation of independent numbers is normal with deviation 1/sqrt(n).
    assert np.mean(one == other) < 1e-3
    r = [np.corrcoef(a, b)[0, 1] for a, b in zip(one.astype(float), other.astype(float), strict=True)]
    assert np.abs(r).max() * np.sqrt(n) < stats.norm.isf(FALSE_ALARMS / 8)


def test_neighbouring_particles_and_words_are_uncorrelated(build: Build) -> None:
    n = 20_000
    numbers = sample(build, n, seed=3).astype(np.float64)
    bound = stats.norm.isf(FALSE_ALARMS / 20) / np.sqrt(n - 1)
    for word in numbers:
        assert abs(np.corrcoef(word[:-1], word[1:])[0, 1]) < bound
    between = np.corrcoef(numbers)[np.triu_indices(4, 1)]
    assert np.abs(between).max() < bound


def test_every_bit_is_as_often_set_as_not(build: Build) -> None:
    n, bits = 20_000, 32 if build.bits == 64 else 24
    words = as_words(build, sample(build, n, seed=9)[0])
    shares = np.array([np.mean(words >> np.uint64(bit) & np.uint64(1)) for bit in range(bits)])
    assert np.abs(shares - 0.5).max() < stats.norm.isf(FALSE_ALARMS / (2 * bits)) * 0.5 / np.sqrt(n)


def test_float_and_double_see_the_same_words() -> None:
    """A search in float follows the same random sequence as one in double."""
    double, single = (sample(Build("generic", bits), 64, seed=2) for bits in (64, 32))
    np.testing.assert_array_equal(np.floor(double * 2.0**24), single.astype(np.float64) * 2.0**24)
