"""A validation error as one sentence: field, value, what is allowed."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel, ValidationError

Location = tuple[int | str, ...]

_TYPES = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "a text",
    "bool_type": "true or false",
    "tuple_type": "an array",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "finite_number": "a finite number",
}


def sentence(error: ValidationError, model: type[BaseModel]) -> str:
    """The first mistake in words, and how many more there are. model: what was validated."""
    # A mistyped name is both unknown and missing; the unknown one says more.
    errors = sorted(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
    first = errors[0]
    text = _one(first["type"], first["loc"], first.get("input"), first.get("ctx", {}), model)
    count = len(errors) - 1
    return text if count == 0 else f"{text[:-1]} (and {count} more to mend in this file)."


def _one(kind: str, loc: Location, value: Any, context: dict[str, Any], model: Any) -> str:
    where = field(loc)
    if kind == "extra_forbidden":
        allowed = ", ".join(_fields_at(model, loc[:-1]))
        return f"{where} is not a known field; allowed are {allowed}."
    if kind == "missing":
        return f"{where} is missing; it is required."
    if kind == "value_error":
        reason = str(context["error"])
        return f"{where}: {reason}." if where else f"{reason}."
    return f"{where} is {_shown(value)}; allowed is {_allowed(kind, context)}."


def _allowed(kind: str, context: dict[str, Any]) -> str:
    simple = _TYPES.get(kind)
    if simple:
        return simple
    match kind:
        case "literal_error":
            return str(context["expected"]).replace("'", '"')
        case "string_pattern_mismatch":
            return f"a text that matches {context['pattern']}"
        case "greater_than":
            return f"more than {context['gt']}"
        case "greater_than_equal":
            return f"at least {context['ge']}"
        case "less_than_equal":
            return f"at most {context['le']}"
        case "too_short":
            return f"at least {context['min_length']} entries"
        case "too_long":
            return f"at most {context['max_length']} entries"
        case "string_too_short":
            return f"at least {context['min_length']} characters"
        case "string_too_long":
            return f"at most {context['max_length']} characters"
    return f"another value ({kind.replace('_', ' ')})"


def field(loc: Location) -> str:
    """("machine", 1, "start", "yaw_deg") as it reads in the file: machine[1].start.yaw_deg.

    Array entries are counted from 1, as people do.
    """
    text = ""
    for part in loc:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _shown(value: Any) -> str:
    text = f'"{value}"' if isinstance(value, str) else str(_lists(value))
    return text if len(text) <= 60 else text[:57] + "..."


def _lists(value: Any) -> Any:
    return [_lists(v) for v in value] if isinstance(value, tuple) else value


def _fields_at(model: Any, loc: Location) -> list[str]:
    """The field names of the table at `loc` below `model`."""
    for part in loc:
        if isinstance(part, str):
            model = model.model_fields[part].annotation
        model = _table_in(model) or model
    return list(model.model_fields)


def _table_in(annotation: Any) -> type[BaseModel] | None:
    """The table inside tuple[Table, ...], Table | None, Annotated[...]."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in get_args(annotation):
        found = _table_in(inner)
        if found:
            return found
    return None
