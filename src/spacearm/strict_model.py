"""What every file's model is made of: numbers that are numbers, and mappings that refuse unknown keys.

Imported only when a file is read, since pydantic takes longer to import than the rest of spacearm.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AllowInfNan, BaseModel, ConfigDict, Strict, model_validator

from spacearm.reading import require_known_keys

Number = Annotated[float, Strict(), AllowInfNan(False)]
"""A finite number; text such as "1.0" and booleans are refused."""


class StrictModel(BaseModel):
    """A mapping in a file; a key that is not in it is refused with the nearest that is."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, given: Any) -> Any:
        require_known_keys(given, [field.alias or name for name, field in cls.model_fields.items()])
        return given
