"""What every file's model is made of: numbers that are numbers, and mappings that refuse unknown keys.

Whatever comes from a file is checked and converted by pydantic models made of these, and by nothing else; the constructors of
our own dataclasses check what the values mean (`checks`). Imported only when a file is read, since pydantic takes longer to
import than the rest of spacearm.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import AllowInfNan, BaseModel, ConfigDict, Strict, model_validator
from pydantic_core import PydanticCustomError

from spacearm.core.reading import require_known_keys

Number = Annotated[float, Strict(), AllowInfNan(False)]
"""A finite number; text such as "1.0" and booleans are refused."""


def wrong_form(words: str) -> PydanticCustomError:
    """Return the error of a value that has none of a key's forms; the words say which are expected, and hold no braces."""
    return PydanticCustomError("form", words)  # type: ignore[arg-type]  # pydantic asks for a literal


def a_list_of(count: int) -> Callable[[Any], Any]:
    """Return a validator that refuses what is no list of this number of entries."""

    def checked(given: Any) -> Any:
        if not isinstance(given, (list, tuple)) or len(given) != count:
            raise wrong_form(f"a list of {count}")
        return given

    return checked


class StrictModel(BaseModel):
    """A mapping in a file; a key that is not in it is refused with the nearest that is."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, given: Any) -> Any:
        require_known_keys(given, [field.alias or name for name, field in cls.model_fields.items()])
        return given
