"""Answers made from a JSON schema: the least that satisfies it, and what breaks it in a chosen way."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

Schema = Mapping[str, Any]


def least(schema: Schema) -> Any:
    """A value that satisfies ``schema``: first option, least number, empty text."""
    return filled(schema, lambda number: number.get("minimum", 0))


def filled(schema: Schema, number: Callable[[Schema], Any]) -> Any:
    """A value with ``number`` for every number."""
    if "anyOf" in schema:
        return filled(schema["anyOf"][0], number)
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return schema["enum"][0]
    match schema.get("type"):
        case "object":
            return {name: filled(part, number) for name, part in schema.get("properties", {}).items()}
        case "number" | "integer":
            return number(schema)
        case "array":
            return [filled(schema["items"], number) for _ in range(schema.get("minItems", 0))]
        case "boolean":
            return False
        case "null":
            return None
    return ""


def numbers_as(schema: Schema, text: str) -> str:
    """JSON with ``text`` for every number, whatever JSON thinks of it."""
    return json.dumps(filled(schema, lambda number: "@number@")).replace('"@number@"', text)


def beyond(schema: Schema) -> str:
    """JSON with every number one increment beyond its upper end."""
    return json.dumps(filled(schema, lambda n: n.get("maximum", 0) + n.get("multipleOf", 1)))


def below(schema: Schema) -> str:
    """JSON with every number one increment below its lower end."""
    return json.dumps(filled(schema, lambda n: n.get("minimum", 0) - n.get("multipleOf", 1)))


def twice(schema: Schema) -> str:
    """A JSON object that gives every key twice, with different values."""
    one = json.dumps(least(schema))[1:-1]
    other = json.dumps(filled(schema, lambda number: number.get("maximum", 1)))[1:-1]
    return f"{{{one}, {other}}}"
