"""The keys of a robot file and their types; `yaml_robot` explains them.

Imported only when such a file is read.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, Strict, field_validator

from spacearm.core.strict_model import Number, StrictModel, wrong_form

Text = Annotated[str, Strict()]


class MimicModel(StrictModel):
    """A joint that follows another."""

    joint: Text
    multiplier: Number = 1.0
    offset: Number = 0.0


class JointModel(StrictModel):
    """A joint between two links."""

    name: Text
    kind: Literal["revolute", "continuous", "prismatic", "fixed"]
    parent: Text
    child: Text
    xyz: list[Number] = [0.0, 0.0, 0.0]  # noqa: RUF012 (pydantic copies defaults)
    rpy: list[Number] | None = None
    rpy_deg: list[Number] | None = None
    axis: list[Number] | None = None
    lower: Number | None = None
    upper: Number | None = None
    lower_deg: Number | None = None
    upper_deg: Number | None = None
    velocity: Number | None = None
    acceleration: Number | None = None
    mimic: MimicModel | None = None


class CapsuleModel(StrictModel):
    """A capsule on a link."""

    link: Text
    start: list[Number] = Field(alias="from")
    end: list[Number] = Field(alias="to")
    radius: Number | None = None


class BoxModel(StrictModel):
    """A box on a link, to be enclosed in capsules."""

    link: Text
    size: list[Number]
    xyz: list[Number] = [0.0, 0.0, 0.0]  # noqa: RUF012
    rpy: list[Number] | None = None
    rpy_deg: list[Number] | None = None
    count: int | None = Field(default=None, alias="capsules", strict=True)


class MassModel(StrictModel):
    """The mass of a link."""

    link: Text
    mass: Number
    com: list[Number] = [0.0, 0.0, 0.0]  # noqa: RUF012
    inertia: list[Number]


class ConfigurationModel(StrictModel):
    """A configuration with a name."""

    name: Text
    q: list[Number] | None = None
    q_deg: list[Number] | None = None


class RobotModel(StrictModel):
    """A robot file."""

    version: int = Field(alias="spacearm-robot")
    name: Text
    notes: list[Text] = []  # noqa: RUF012
    tip: Text | None = None
    base: Literal["fixed", "floating"] = "fixed"
    link_radius: Number | None = None
    joints: list[JointModel]
    capsules: list[CapsuleModel] = []  # noqa: RUF012
    boxes: list[BoxModel] = []  # noqa: RUF012
    masses: list[MassModel] = []  # noqa: RUF012
    configurations: list[ConfigurationModel] = []  # noqa: RUF012
    self_collision: Literal["none", "computed"] | list[list[Text]] = "none"

    @field_validator("self_collision", mode="before")
    @classmethod
    def _word_or_pairs(cls, given: Any) -> Any:
        if not isinstance(given, list) and given not in ("none", "computed"):
            raise wrong_form("none, computed, or a list of pairs of links")
        return given
