"""How much errors of a tumbling base's attitude grow over many panels: bounds of products of the flows over them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.proof.polynomial_bounds import longest_products


def rotations(rng: np.random.Generator, count: int, spread: float) -> np.ndarray:
    """Draw matrices near rotations: what a tumbling base does to an error of its attitude."""
    turned = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    return turned @ (np.eye(3) + spread * rng.normal(size=(count, 3, 3)))


def by_brute_force(X: np.ndarray) -> np.ndarray:
    """The greatest norm of X_q ... X_(p + 1) over all q from p to the last, for every p."""
    out = np.ones(len(X))
    for p in range(len(X)):
        product = np.eye(3)
        for q in range(p + 1, len(X)):
            product = X[q] @ product
            out[p] = max(out[p], float(np.linalg.norm(product, 2)))
    return out


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 12), st.sampled_from([0.0, 1e-3, 0.1]))
def test_no_product_is_longer_than_its_bound(seed: int, count: int, most: int, spread: float) -> None:
    X = rotations(np.random.default_rng(seed), count, spread)
    bound = longest_products(X, most=most)
    assert bound.shape == (count,)
    assert (bound >= by_brute_force(X) * (1 - 1e-12)).all()


@pytest.mark.parametrize("most", [50, 300])
def test_products_of_rotations_do_not_grow_with_their_number(most: int) -> None:
    bound = longest_products(rotations(np.random.default_rng(0), 5000, 0.0), most=most)
    assert bound.max() < 4.0  # the root of 3, once for each of two norms of whole products
