"""The JSON schema of problem files, by which editors complete, explain and check them as they are written."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from spacearm.planner.settings import TIME_LAWS, PlannerSettings, Weights
from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty

SCHEMA_FILE = Path(__file__).with_name("problem.schema.json")
"""Where the schema is in the installed package; name it in a problem file's first line:
``# yaml-language-server: $schema=...``."""

_RECORDS = (Weights, PSO, IPSO, FeasibleFirst, Penalty)


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
    from pydantic import TypeAdapter

    told = _told(PSO) | _told(record) if record is IPSO else _told(record)
    properties: dict[str, Any] = {} if record in (PlannerSettings, Weights) else {"kind": {"const": record.__name__}}
    for name, form in TypeAdapter(record).json_schema()["properties"].items():
        plain = {key: value for key, value in form.items() if key != "title" and not (key == "default" and _is_whole(value))}
        properties[name] = {**({"description": told[name]} if name in told else {}), **plain}
    if record is PlannerSettings:
        properties["time_law"]["enum"] = list(TIME_LAWS)
        counts = properties["interior_points"]
        counts["anyOf"] = [{"type": "integer"}, {"type": counts.pop("type"), "items": counts.pop("items"), "minItems": 1}]
    out: dict[str, Any] = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**out, "required": ["kind"]} if record in (IPSO, Penalty) else out  # the others are what a mapping means


def _is_whole(default: Any) -> bool:
    """Whether a default is a record, which its own definition tells, or null."""
    return default is None or isinstance(default, dict)


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
