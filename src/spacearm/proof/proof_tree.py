"""The proof that all pairs of bodies keep apart, as data: which plane separates a pair on which stretch of the path.

A proof is a forest. Its roots are the pairs of outermost bodies that must keep apart, on the whole path. A *node* is a pair of
bodies on a stretch of the path, and the proof says one of four things of it:

- it is settled, by a plane with a given normal;
- both halves of the stretch follow;
- the members of the first body, which is a bundle, follow; or those of the other one.

Whoever reads a proof makes the nodes that follow by itself. So no pair and no instant can be missing from a proof, whatever it
says. `claim` says what the roots are, and `checker` whether the planes are right.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import as_whole, shown
from spacearm.core.errors import FileFormatError

Array = NDArray[np.float64]

SETTLED, HALVES, MEMBERS_OF_FIRST, MEMBERS_OF_OTHER = 0, 1, 2, 3
"""What a proof says of a node."""

VERSION = 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class ProofTree(Brief):
    """A proof, level by level: first the roots, then all nodes that follow from them, in their order, and so on.

    Attributes:
        steps: (s,) uint8, what is said of every node.
        directions: (d, 3) the normals of the planes for the settled nodes, in order: from the other body to the first one, in
            the inertial frame as it is at the stretch's midpoint; of any length.
    """

    steps: NDArray[np.uint8]
    directions: Array

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, as a file holds them: the arrays in base64, directions as little-endian float64."""
        return {
            "spacearm-proof": VERSION,
            "nodes": len(self.steps),
            "planes": len(self.directions),
            "steps": b64encode(np.packbits(_bits(self.steps)).tobytes()).decode("ascii"),
            "directions": b64encode(self.directions.astype("<f8").tobytes()).decode("ascii"),
        }

    @classmethod
    def from_dict(cls, values: Any) -> ProofTree:
        """Return the proof of plain values.

        Raises:
            FileFormatError: they are none.
        """
        given = cast(dict[str, Any], values) if isinstance(values, dict) else {}
        version = given.get("spacearm-proof")
        if type(version) is not int or version != VERSION:
            raise FileFormatError(f"the proof is {shown(values)}, expected a mapping with spacearm-proof: {VERSION}")
        try:
            nodes, planes = (
                as_whole(f"the proof's {name}", given[name], FileFormatError, at_least=0) for name in ("nodes", "planes")
            )
            packed = np.frombuffer(b64decode(given["steps"], validate=True), np.uint8)
            if len(packed) != -(-2 * nodes // 8):  # before room is made for them
                raise ValueError(f"{len(packed)} bytes hold no {nodes} nodes")
            bits = np.unpackbits(packed, count=2 * nodes).reshape(nodes, 2)
            directions = np.frombuffer(b64decode(given["directions"], validate=True), "<f8").reshape(planes, 3)
        except (KeyError, TypeError, ValueError) as fault:
            raise FileFormatError(
                f"the proof cannot be read ({fault}), expected it as spacearm wrote it; prove the motion anew"
            ) from None
        steps = (2 * bits[:, 0] + bits[:, 1]).astype(np.uint8)
        return cls(steps=steps, directions=directions.astype(np.float64))


def _bits(steps: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the two bits (s, 2) of every step."""
    return np.stack([steps // 2, steps % 2], axis=1).astype(np.uint8)
