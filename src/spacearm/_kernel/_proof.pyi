"""The finder of proofs, compiled. Written by tools/kernel_stub.py with nanobind 3.1.0: do not edit."""

import enum
from typing import Annotated

import numpy
from numpy.typing import NDArray


class Tables:
    """Joints, bodies and pairs, which stay the same for a robot and a scene."""

    def __init__(self, *, parent: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], dof: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], revolute: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')], multiplier: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], offset: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], placement: Annotated[NDArray[numpy.float64], dict(shape=(None, 4, 4), order='C')], dofs: int, frame: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], first_point: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], points: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], disc: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], axis: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], radius: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], center: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], reach: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], half_space: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')], first_member: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], members: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], owner: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], first: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], other: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], motion_of: Annotated[NDArray[numpy.int64], dict(shape=(None, None), order='C')], sign: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], order: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C')], free: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')], whole_order: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]) -> None: ...

class Path:
    """A curve and bounds of its pieces; see `PathIntervals`."""

    def __init__(self, *, ends: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C')], least_rate: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], greatest_rate: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], second: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], size: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], rounding: float, breaks: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], coefficients: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C')]) -> None: ...

class Held:
    """What pairs are held to; see `HeldClearances`."""

    def __init__(self, *, required: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], phase: Annotated[NDArray[numpy.int64], dict(shape=(None, None), order='C')], near: Annotated[NDArray[numpy.int64], dict(shape=(None, None), order='C')], held: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], until: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], since: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], known_excess: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], share: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> None: ...

class Status(enum.Enum):
    """What the finder thinks."""

    HOLDS = 0

    FAILS = 1

    UNDECIDED = 2

class Suspect:
    """A pair of shapes that is close; `first` is -1 where none was measured."""

    @property
    def first(self) -> int: ...

    @property
    def other(self) -> int: ...

    @property
    def u(self) -> float: ...

    @property
    def clearance(self) -> float: ...

class Found:
    """What a search found."""

    @property
    def status(self) -> Status: ...

    @property
    def steps(self) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

    @property
    def directions(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def closest(self) -> list[Suspect]: ...

    @property
    def worst(self) -> Suspect: ...

    @property
    def nodes(self) -> int: ...

    @property
    def stretches(self) -> int: ...

class FloatingBase:
    def __init__(self, *, parent: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], revolute: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')], joint_of_body: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], mass: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], com: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], inertia: Annotated[NDArray[numpy.float64], dict(shape=(None, 3, 3), order='C')], greatest: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], spread: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], base_least: float, ends: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C')], start: Annotated[NDArray[numpy.float64], dict(shape=(None, 4), order='C')], coefficients: Annotated[NDArray[numpy.float64], dict(shape=(None, None, 4), order='C')], begin: float, center: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], velocity: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], angular: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], attitude_error: float) -> None: ...

    def place(self, u: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], frames: Annotated[NDArray[numpy.float64], dict(shape=(None, None, 3, 4), order='C')]) -> NDArray[numpy.float64]: ...

    def bounds(self, frames: Annotated[NDArray[numpy.float64], dict(shape=(None, None, 3, 4), order='C')], rate: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], deviation: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], step: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], half: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> dict: ...

class PlacedBody:
    """A convex body in world coordinates; see `ConvexBodies`."""

    def __init__(self, *, points: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], disc: float, axis: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], radius: float, half_space: bool) -> None: ...

def nearest_points(first: PlacedBody, other: PlacedBody) -> tuple[float, tuple[float, float, float], bool]:
    """
    Return the clearance of two bodies, not above 0 where they meet [m]; the unit vector in which they are apart, from the other one to the first; and whether it separates their cores.
    """

class Clearances:
    """Measures the clearances of the tables' pairs along a path."""

    def __init__(self, *, tables: Tables, path: Path, tracking: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], start: Annotated[NDArray[numpy.float64], dict(shape=(4, 4), order='C')], floating: FloatingBase | None) -> None: ...

    def least(self, u: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], limit: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], fill: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], in_tube: bool = False) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))], Annotated[NDArray[numpy.int64], dict(shape=(None, None, None, None))]]:
        """
        Return the least clearance of every link and other body (r, l, k + l), obstacles first, then links, at instants (r,) of the path [m]; and the two shapes that have it (r, l, k + l, 2), or -1. Two links are in the row of the one that comes first. Where nothing is found below `limit` (l, k + l) it is `fill` (l, k + l). Pairs with a limit of minus infinity are left out. In the tube: less what the tracking error may take.
        """

    def between(self, u: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], first: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], other: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')], in_tube: bool = False) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """
        Return the clearances (r,) of pairs of shapes (r,) and (r,), each at an instant (r,) of its own [m].
        """

def find_proof(*, tables: Tables, path: Path, held: Held, tracking: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], start: Annotated[NDArray[numpy.float64], dict(shape=(4, 4), order='C')], floating: FloatingBase | None, resolution: float) -> Found:
    """Search a proof that all pairs keep more than they are held to."""
