"""MoveIt's allowed collision matrix: which links of the robot need not keep clear of each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from spacearm.robot.left_out import unchecked_pairs
from spacearm.robot.model import Robot
from spacearm.robot.self_collision import with_allowed_pairs

if TYPE_CHECKING:
    from spacearm.planner.moveit.part import AllowedCollisionMatrix

_MOST_NAMED = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """A matrix as it is stated: whether two names may touch, and each name's default."""

    names: tuple[str, ...]
    entries: dict[tuple[str, str], bool]
    defaults: dict[str, bool]

    def may_touch(self, first: str, second: str) -> bool:
        """Whether two links or objects may touch; as in MoveIt, what has neither entry nor default may not."""
        stated = [self.defaults[name] for name in (first, second) if name in self.defaults]
        return self.entries.get((first, second), bool(stated) and all(stated))


def read_matrix(matrix: AllowedCollisionMatrix | None) -> Matrix | None:
    """Read a scene's `allowed_collision_matrix`; None where there is none.

    Raises:
        FileFormatError: one that is not square.
    """
    if matrix is None:
        return None
    names, rows = matrix.entry_names, matrix.entry_values
    if len(rows) != len(names):
        raise matrix.error(f"entry_values has {len(rows)} rows, expected one for each of {len(names)} entry_names")
    entries: dict[tuple[str, str], bool] = {}
    for i, row in enumerate(rows):
        if len(row) != len(names):
            words = f"entry_values[{i}] is {row}, expected a list of {len(names)} true or false"
            raise matrix.error(words, "entry_values", i)
        for j in range(i + 1, len(names)):
            entries[names[i], names[j]] = entries[names[j], names[i]] = row[j]
    defaults_of, values = matrix.default_entry_names, matrix.default_entry_values
    if len(values) != len(defaults_of):
        words = f"default_entry_values is {values}, expected a list of {len(defaults_of)} true or false"
        raise matrix.error(words, "default_entry_values")
    defaults = dict(zip(defaults_of, values, strict=True))
    return Matrix(names=tuple(names), entries=entries, defaults=defaults)


def robot_with_matrix(robot: Robot, matrix: Matrix) -> Robot:
    """Return the robot with the pairs of links that a matrix does not allow to touch.

    Pairs that no joint moves against each other are left out, as for an SRDF.
    """
    of_pairs = ("self-collision ", "the envelopes of ")  # how notes on pairs begin: new ones are added in their place
    kept = tuple(note for note in robot.notes if not note.startswith(of_pairs))
    return with_allowed_pairs(replace(robot, notes=kept), matrix.may_touch, by="MoveIt's matrix")


def say_matrix(robot: Robot, matrix: Matrix, objects: set[str], held: set[str], notes: list[str], *, used: bool) -> None:
    """Say in notes what of a matrix is left out.

    Args:
        robot: with its own pairs, or those of the matrix.
        matrix: the matrix.
        objects: ids of the world's objects.
        held: ids of those that are attached to links.
        notes: gets the sentences.
        used: whether the robot's pairs are those of the matrix.
    """
    if not used:
        more = _unchecked(robot, matrix)
        if more:
            said = ", ".join(f"{a} and {b}" for a, b in more[:_MOST_NAMED])
            said += f" and {len(more) - _MOST_NAMED} more" if len(more) > _MOST_NAMED else ""
            notes.append(
                f"the scene's matrix wants pairs of links kept clear that the robot does not check: {said}; acm=True takes the "
                "matrix"
            )
    links = {capsule.name for capsule in robot.capsules} | held
    touching = {name for name in objects if any(matrix.may_touch(name, link) for link in links)}
    if touching:
        said = ", ".join(f"'{name}'" for name in sorted(touching)[:_MOST_NAMED])
        notes.append(f"the scene's matrix lets links touch {said}, which is left out: every link keeps clear of every object")


def _unchecked(robot: Robot, matrix: Matrix) -> list[tuple[str, str]]:
    """List the pairs of links that a matrix names and wants kept clear, that can move, and that nobody checks.

    Pairs that cannot meet within the limits are not among them: the certificate proves these.
    """
    named = {*matrix.names, *matrix.defaults}
    return [
        one.links
        for one in unchecked_pairs(robot)
        if one.reason != "rigid" and named.issuperset(one.links) and not matrix.may_touch(*one.links)
    ]
