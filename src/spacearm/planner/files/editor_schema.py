"""The JSON schema of problem files, by which editors complete, explain and check them as they are written."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

from spacearm.planner.settings import TIME_LAWS, PlannerSettings, Weights
from spacearm.settings import as_dict
from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty

SCHEMA_FILE = Path(__file__).with_name("problem.schema.json")
"""Where the schema is in the installed package; name it in a problem file's first line:
``# yaml-language-server: $schema=...``."""

_RECORDS = (Weights, PSO, IPSO, FeasibleFirst, Penalty)
_TYPES: dict[str, dict[str, Any]] = {
    "int": {"type": "integer"},
    "float": {"type": "number"},
    "bool": {"type": "boolean"},
    "str": {"type": "string"},
    "None": {"type": "null"},
    "tuple[int, ...]": {"type": "array", "items": {"type": "integer"}, "minItems": 1},
    "tuple[float, float]": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
    "Constraints": {"anyOf": [{"$ref": "#/$defs/FeasibleFirst"}, {"$ref": "#/$defs/Penalty"}]},
    **{record.__name__: {"$ref": f"#/$defs/{record.__name__}"} for record in _RECORDS},
}


def problem_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of problem files, made from the models that read them.

    What it accepts may still be refused for what it means: a joint beyond its limits, a frame that is not there.
    """
    from spacearm.planner.files.schema import ProblemModel

    schema = _tidied(ProblemModel.model_json_schema(by_alias=True))
    definitions = schema.pop("$defs")
    _take_words(schema["properties"]["robot"])
    _take_words(schema["properties"]["goal"])
    _take_words(definitions["ObstacleModel"]["properties"]["moveit"])
    _take_words(schema["properties"]["base_start"], "mass_center")
    _take_words(schema["properties"]["base_goal"], "as_it_was")
    schema["oneOf"] = [{"required": ["start"]}, {"required": ["start_deg"]}]
    for record in _RECORDS:
        definitions[record.__name__] = _record(record)
    planner = schema["properties"]["planner"]
    schema["properties"]["planner"] = {"description": planner["description"], **_record(PlannerSettings)}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "spacearm problem file",
        **schema,
        "$defs": dict(sorted(definitions.items())),
    }


def _take_words(schema: dict[str, Any], *words: str) -> None:
    """A word alone, any or one of a few, stands for a mapping of one key."""
    schema["anyOf"] = [{"enum": list(words)} if words else {"type": "string"}, {"$ref": schema.pop("$ref")}]


def _tidied(schema: Any) -> Any:
    """Leave out what pydantic adds for itself: titles, and null for what is left out."""
    if isinstance(schema, list):
        return [_tidied(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    out = {}
    for key, value in schema.items():
        if key in ("properties", "$defs"):
            out[key] = {name: _tidied(inner) for name, inner in value.items()}
        elif not (key == "title" or (key == "default" and value in (None, [], {}))):
            out[key] = _tidied(value)
    for key in ("anyOf", "allOf"):
        if key in out:
            forms = [form for form in out.pop(key) if form != {"type": "null"}]
            out |= forms[0] if len(forms) == 1 else {key: forms}
    return out


def _record(record: type) -> dict[str, Any]:
    """Describe a record of settings: its fields' types, defaults, and what its docstring says of each."""
    told = _told(PSO) | _told(record) if record is IPSO else _told(record)
    plain = as_dict(record()) if record in (PlannerSettings, Weights) else {}
    properties: dict[str, Any] = {}
    if record not in (PlannerSettings, Weights):
        properties["kind"] = {"const": record.__name__}
    for field in dataclasses.fields(record):
        default = plain.get(field.name, field.default)
        properties[field.name] = {
            **({"description": told[field.name]} if field.name in told else {}),
            **_type(str(field.type)),
            **({"default": default} if isinstance(default, (bool, int, float, str, list)) else {}),
        }
    if record is PlannerSettings:
        properties["time_law"]["enum"] = list(TIME_LAWS)
        counts = properties["interior_points"]
        counts["anyOf"] = [{"type": "integer"}, {key: counts.pop(key) for key in ("type", "items", "minItems")}]
    out: dict[str, Any] = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**out, "required": ["kind"]} if record in (IPSO, Penalty) else out  # the others are what a mapping means


def _type(annotation: str) -> dict[str, Any]:
    words = re.fullmatch(r"Literal\[(.*)\]", annotation)
    if words:
        return {"enum": re.findall(r"\w+", words[1])}
    forms = [_TYPES[form] for form in annotation.split(" | ")]
    return dict(forms[0]) if len(forms) == 1 else {"anyOf": forms}


def _told(record: type) -> dict[str, str]:
    """Return what a docstring's Attributes say, by name."""
    found: dict[str, str] = {}
    name = ""
    for line in (record.__doc__ or "").split("Attributes:")[-1].splitlines():
        start = re.match(r" {8}(\w+): (.*)", line)
        if start:
            name = start[1]
            found[name] = start[2].strip()
        elif name and line.startswith(" " * 12):
            found[name] += f" {line.strip()}"
        else:
            name = ""
    return {key: re.sub(r"\bNone\b", "null", text) for key, text in found.items()}
