"""Every mistake in a spec as one plain sentence: where it is, what was found, what is allowed."""

import difflib
import types
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from rigid.io.errors import quoted

CUTOFF = 0.5
"""Likeness from which a known name is offered in place of an unknown one (difflib's ratio)."""

WORDS = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be a text in quotes",
    "path_type": "must be the path of a file, in quotes",
    "tuple_type": "must be a list, as in [ ... ]",
    "model_type": "must be a table of keys",
    "mapping_type": "must be a table of keys",
    "dict_type": "must be a table of keys",
    "finite_number": "must be a finite number",
    "greater_than": "must be above {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "multiple_of": "must be a multiple of {multiple_of:g}",
    "string_pattern_mismatch": "must be a name without [ ] , / and without blanks at its ends",
}
"""pydantic's kinds of mistake in the words of someone who writes a TOML file."""

NOUNS = {"position": "position", "accept": "defect"}
"""What the words of a key are called; the words of other keys are values."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most like `name`, capitals and small letters being alike."""
    folded: dict[str, str] = {}
    for one in known:
        folded.setdefault(one.casefold(), one)
    near = difflib.get_close_matches(name.casefold(), folded, 1, CUTOFF)
    return folded[near[0]] if near else None


def unknown(what: str, name: Any, known: Iterable[str]) -> str:
    """Say that a name is not known, and which one may have been meant."""
    listed = list(known)
    near = nearest(str(name), listed)
    hint = f"did you mean '{near}'?" if near else f"known are {', '.join(listed)}"
    return f"unknown {what} {quoted(str(name))}; {hint}"


def sentence(path: Path, given: Mapping, body: type[BaseModel], error: Mapping[str, Any]) -> str:
    """Say where a mistake is, what was found and what is allowed; a line for each of several.

    - `given`: the file as TOML has it. - `body`: the model it was read into.
    - `error`: one entry of a ValidationError's `errors()`.
    """
    place = [part for part in error["loc"] if part != "arguments" or error["loc"][0] != "priors"]
    kind, found = error["type"], error["input"]
    if kind == "extra_forbidden":
        known = keys(annotation_at(body, place[:-1]))
        says = unknown("key", place.pop(), sorted(known))
    elif kind == "literal_error":
        says = _not_listed(body, place, found)
    elif kind == "missing":
        listed = _field_words(body, place)
        says = f"is missing; it is one of {', '.join(listed)}" if listed else "is missing"
    elif kind == "value_error":
        message = str(error["ctx"]["error"])
        says = message[:1].lower() + message[1:]
    else:
        other = error["msg"][:1].lower() + error["msg"][1:]
        words = WORDS[kind].format(**error.get("ctx", {})) if kind in WORDS else other
        says = f"{words}; found {quoted(found)}"
        if place == ["records"]:
            says = "every record is a table of its own, headed [[records]]"
    where = f"{path} {_where(given, place)}"
    return "\n".join(f"{where}: {one}" for one in says.split("\n"))


def _not_listed(body: type[BaseModel], place: list, found: Any) -> str:
    """Say that a word is none of those allowed; cuts the place back to what holds the word."""
    if place[-1] == "[key]":
        del place[-2:]
        key_type = get_args(_plain(annotation_at(body, place)))[0]
        return unknown("channel", found, get_args(key_type))
    allowed = get_args(_plain(annotation_at(body, place)))
    if not isinstance(found, str):
        return f"must be one of {', '.join(allowed)}; found {quoted(found)}"
    last = next((part for part in reversed(place) if isinstance(part, str)), "")
    return unknown(NOUNS.get(last, "value"), found, allowed)


def _field_words(body: type[BaseModel], place: list) -> list[str]:
    """Return the words that a key of a table may have, as its JSON Schema lists them."""
    table = _plain(annotation_at(body, place[:-1]))
    found = table.model_fields[place[-1]].json_schema_extra if keys(table) else None
    return list(found.get("enum", ())) if isinstance(found, dict) else []


def _where(given: Mapping, place: list) -> str:
    """Name a place in the file, records by their names."""
    if not place:
        return "[top level]"
    if place[0] == "records" and len(place) > 1 and isinstance(place[1], int):
        record = given["records"][place[1]]
        name = record.get("name") if isinstance(record, Mapping) else None
        said = quoted(name) if isinstance(name, str) and name else f"number {place[1] + 1}"
        return " ".join([f"[[records]] {said}", *_inner(place[2:])])
    return " ".join([f"[{place[0]}]", *_inner(place[1:])])


def _inner(place: list) -> list[str]:
    """Keys below a table; entries of a list count from 1."""
    said = ".".join(f"entry {p + 1}" if isinstance(p, int) else str(p) for p in place)
    return [said] if said else []


def keys(annotation: Any) -> list[str]:
    """Keys that a table of this type may have."""
    plain = _plain(annotation)
    if isinstance(plain, type) and issubclass(plain, BaseModel):
        return list(plain.model_fields)
    return []


def annotation_at(body: type[BaseModel], place: list) -> Any:
    """Return the type of what stands at a place of the file."""
    here: Any = body
    for part in place:
        plain = _plain(here)
        if isinstance(plain, type) and issubclass(plain, BaseModel):
            here = plain.model_fields[str(part)].annotation
        else:  # a mapping's values, a tuple's entries
            inner = [a for a in get_args(plain) if a is not Ellipsis]
            here = inner[-1] if inner else None
    return here


def _plain(annotation: Any) -> Any:
    """Return a type without its annotations and without `| None`."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return _plain(get_args(annotation)[0])
    if origin in (Union, types.UnionType):
        return _plain(next(a for a in get_args(annotation) if a is not type(None)))
    return annotation
