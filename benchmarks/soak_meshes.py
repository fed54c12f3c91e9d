"""A soak of meshes: drawn as exporters write them, enclosed, and looked at by a checker that knows the solid.

Boxes, plates, balls, rings, cones, angles, hulls, alone, apart, overlapping, nested or glued; inside out, mirrored, doubled,
with a second skin, flipped faces, rounded corners, T-junctions, small holes, walls, gaps, openings; turned, and scaled from
1e-3 to 1e3; from memory, STL, OBJ, PLY, GLB, and COLLADA in drawn units. Every point of the surface, and of the solid that it
came from, must be in the balls, in the convex pieces, or in the shapes of a link. A mesh is drawn from (seed, number), which
is printed with whatever is wrong.

    python benchmarks/soak_meshes.py --count 3000 --seed 0
    python benchmarks/soak_meshes.py --seed 0 --only 1234
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from fault_search import Case, Outcome, search


def look(case: Case) -> Outcome:
    """Draw a mesh, enclose it, and look for the points of the solid."""
    from support.drawn_meshes import looked_at

    with tempfile.TemporaryDirectory() as folder:
        found = looked_at(case.seed, case.number, Path(folder))
    refused = [f"refused: {found.refused.split(',')[0][:60]}"] if found.refused else []
    return Outcome(became=[*found.drawn, *refused], complaints=found.complaints)


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="meshes"))
