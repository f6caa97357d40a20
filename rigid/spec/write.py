"""A spec made of values as the text of a file."""

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from rigid.spec.read import parse_spec
from rigid.spec.values import Spec


def build_spec(name: str, folder: Path, tables: Mapping[str, Any]) -> Spec:
    """Make a spec of values, as if it stood in `folder`/`name`.toml.

    - `folder`: from which its files are named. - `tables`: by the keys of a spec; values of this
      package, or what TOML would hold.

    Raises InputError with one line for each mistake.
    """
    return parse_spec(spec_text(tables), folder / f"{name}.toml")


def spec_text(tables: Mapping[str, Any]) -> str:
    """Return the TOML of a spec."""
    plain = {key: _plain(value) for key, value in tables.items() if value is not None}
    return "\n".join(_lines(plain)) + "\n"


def _lines(tables: Mapping[str, Any]) -> Iterator[str]:
    """Yield bare keys first, then tables, then lists of tables."""
    for key, value in tables.items():
        if not _is_table(value) and not _are_tables(value):
            yield f"{key} = {toml_value(value)}"
    for key, value in tables.items():
        for header, table in _headed(key, value):
            yield f"\n{header}"
            yield from (f"{_key(k)} = {toml_value(v)}" for k, v in table.items())


def _headed(key: str, value: Any) -> list[tuple[str, Mapping[str, Any]]]:
    if _is_table(value):
        return [(f"[{key}]", value)]
    return [(f"[[{key}]]", one) for one in value] if _are_tables(value) else []


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping)


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(map(_is_table, value))


def _plain(value: Any) -> Any:
    """What TOML can hold; what was left out stays out."""
    if isinstance(value, BaseModel):
        return _plain(value.model_dump(exclude_unset=True))
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(v) for v in value]
    return value.as_posix() if isinstance(value, Path) else value


def toml_value(value: Any) -> str:
    """Return a text, number, list or table as TOML writes it in one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {toml_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)
