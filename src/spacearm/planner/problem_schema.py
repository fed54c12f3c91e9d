"""The keys of a problem file and their types; `files` explains them.

Imported only when such a file is read.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, Strict, model_validator
from pydantic_core import PydanticCustomError

from spacearm.strict_model import Number, StrictModel

Text = Annotated[str, Strict()]
Joints = list[Number] | dict[Text, Number]


class RobotModel(StrictModel):
    """A robot: a name, or a file with options."""

    name: Text | None = None
    file: Text | None = None
    tip: Text | None = None
    velocity_limit: Number | None = None
    acceleration_limit: Number | None = None
    collision: Literal["urdf", "none"] = "urdf"

    @model_validator(mode="before")
    @classmethod
    def _named(cls, given: Any) -> Any:
        """Take ``robot: zhang2022`` for ``robot: {name: zhang2022}``."""
        if not isinstance(given, (str, dict)):
            raise PydanticCustomError("form", "a name, or a mapping (key: value)")
        return {"name": given} if isinstance(given, str) else given


class SphereModel(StrictModel):
    """A sphere."""

    center: list[Number]
    radius: Number


class ObstacleModel(StrictModel):
    """An obstacle: one key, its shape."""

    sphere: SphereModel


class GoalModel(StrictModel):
    """A goal: a configuration or a position."""

    configuration: Joints | None = None
    configuration_deg: Joints | None = None
    position: list[Number] | None = None
    tolerance: Number | None = None
    frame: Text | None = None


class ProblemModel(StrictModel):
    """A problem file."""

    version: int = Field(alias="spacearm")
    robot: RobotModel
    scene: list[ObstacleModel] = []  # noqa: RUF012 (pydantic copies defaults)
    start: Joints | None = None
    start_deg: Joints | None = None
    goal: GoalModel
    base: Text = "fixed"
    planner: dict[Text, Any] = {}  # noqa: RUF012

    @model_validator(mode="before")
    @classmethod
    def _left_out(cls, given: Any) -> Any:
        """Take a key with nothing behind it for one that is left out."""
        if not isinstance(given, dict):
            return given
        return {key: value for key, value in given.items() if value is not None or key not in ("scene", "planner")}
