"""Finding and reading a spec; every mistake in it becomes one plain sentence."""

import difflib
import tomllib
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from rigid.errors import InputError
from rigid.spec.values import RecordSpec, Spec, SpecBody

PACKAGE = Path(__file__).resolve().parents[1]
EXAMPLES = (PACKAGE / "examples" / "fits", PACKAGE.parent / "fits")
"""Where the shipped specs lie: inside a wheel, or beside the package in a checkout."""


def find_spec(name: str) -> Path:
    """Return the file of a spec: a path, `./fits/NAME.toml`, or the shipped example NAME.

    Raises InputError naming what was looked at.
    """
    tried = [Path(name), Path("fits") / f"{name}.toml"]
    tried += [folder / f"{name}.toml" for folder in EXAMPLES]
    for path in tried:
        if path.is_file():
            return path
    shipped = sorted({p.stem for folder in EXAMPLES for p in folder.glob("*.toml")})
    raise InputError(
        f"no spec '{name}': looked for a file {tried[0]} and for {tried[1]}; "
        f"shipped examples are {', '.join(shipped) or 'none'}"
    )


def load_spec(path: Path) -> Spec:
    """Read a spec; file names in it become absolute.

    Raises InputError with one line for each mistake.
    """
    try:
        text = path.read_text(encoding="utf-8")
        given = tomllib.loads(text)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None
    try:
        body = SpecBody.model_validate(given)
    except ValidationError as error:
        lines = [_sentence(path, given, dict(e)) for e in error.errors()]
        raise InputError("\n".join(lines)) from None
    _require_unique(path, body.records)
    folder = path.resolve().parent
    records = tuple(r.model_copy(update={"file": folder / r.file}) for r in body.records)
    bands = body.bands
    if bands is not None:
        bands = bands.model_copy(update={"posterior": folder / bands.posterior})
    fields = {name: getattr(body, name) for name in SpecBody.model_fields}
    fields |= {"records": records, "bands": bands, "path": path, "text": text}
    return Spec.model_construct(**fields)


def _require_unique(path: Path, records: tuple[RecordSpec, ...]) -> None:
    """Refuse two records of the same name and cylinder."""
    seen = set()
    for record in records:
        key = (record.name, record.cylinder)
        if key in seen:
            raise InputError(
                f"{path} [[records]]: '{record.name}' on cylinder {record.cylinder} stands twice; "
                "give one of them another name"
            )
        seen.add(key)


def _sentence(path: Path, given: dict, error: dict[str, Any]) -> str:
    """Say where a mistake is, what was found and what is allowed."""
    place = [part for part in error["loc"] if not _is_internal(part)]
    where = _where(given, place[:-1] if error["type"] == "extra_forbidden" else place)
    if error["type"] == "extra_forbidden":
        key, allowed = str(place[-1]), _keys_at(SpecBody, place[:-1])
        near = difflib.get_close_matches(key, allowed, 1)
        hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(sorted(allowed))}"
        return f"{path} {where}: unknown key '{key}'; {hint}"
    message = error["msg"].removeprefix("Value error, ")
    message = message[:1].lower() + message[1:]
    if error["type"] == "missing":
        return f"{path} {where}: is missing"
    if error["type"] == "value_error":
        return f"{path} {where}: {message}"
    return f"{path} {where}: {message}; found {error['input']!r}"


def _is_internal(part: Any) -> bool:
    """Whether a part of pydantic's location is no key of the file."""
    return isinstance(part, str) and (part.startswith("function-") or part == "Known")


def _where(given: dict, place: list) -> str:
    """Name a place in the file, records by their names."""
    if not place:
        return "[top level]"
    if place[0] == "records" and len(place) > 1 and isinstance(place[1], int):
        record = given["records"][place[1]]
        name = record.get("name", f"number {place[1] + 1}") if isinstance(record, dict) else "?"
        inner = ".".join(str(p) for p in place[2:])
        return f"[[records]] '{name}'" + (f" {inner}" if inner else "")
    inner = ".".join(str(p) for p in place[1:])
    return f"[{place[0]}]" + (f" {inner}" if inner else "")


def _keys_at(model: Any, place: list) -> list[str]:
    """Keys that a table of the file may have."""
    for part in place:
        if isinstance(part, int):
            continue
        if not _fields(model):
            return []
        model = _fields(model).get(str(part), type(None))
    return list(_fields(model))


def _fields(annotation: Any) -> dict[str, Any]:
    """Keys and types of the first model inside an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return {name: f.annotation for name, f in annotation.model_fields.items()}
    for inner in get_args(annotation):
        found = _fields(inner)
        if found:
            return found
    return {}
