"""Finding and reading a spec; every mistake in it becomes one plain sentence."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rigid.io.errors import InputError
from rigid.io.files import MIB, read_bytes
from rigid.spec.sentences import nearest, sentence
from rigid.spec.values import Spec, SpecBody

MOST_BYTES = 4 * MIB
"""Of a spec."""

PACKAGE = Path(__file__).resolve().parents[1]
EXAMPLES = (PACKAGE / "examples" / "fits", PACKAGE.parent / "fits")
"""Where the shipped specs lie: inside a wheel, or beside the package in a checkout."""


def find_spec(name: str) -> Path:
    """Return the file of a spec: a path, `./fits/NAME.toml`, or the shipped example NAME.

    Raises InputError naming what was looked at.
    """
    tried = [Path(name), Path("fits") / f"{name}.toml"]
    shipped = [folder / f"{name}.toml" for folder in EXAMPLES]
    for path in (*tried, *shipped):
        if path.is_file():
            return path
    examples = sorted({p.stem for folder in EXAMPLES for p in folder.glob("*.toml")})
    near = nearest(name, examples)
    hint = f"did you mean '{near}'? " if near else ""
    raise InputError(
        f"no spec '{name}': {hint}there is no file {tried[0]} and no {tried[1]}; "
        f"shipped examples are {', '.join(examples) or 'none'}"
    )


def load_spec(path: Path) -> Spec:
    """Read a spec; file names in it become absolute.

    Raises InputError with one line for each mistake.
    """
    try:
        text = read_bytes(path, MOST_BYTES).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from None
    return parse_spec(text, path)


def parse_spec(text: str, path: Path) -> Spec:
    """Take a text as the spec that stands at `path`, whether it does or not.

    Raises InputError with one line for each mistake.
    """
    try:
        given = tomllib.loads(text)
    except RecursionError:
        raise InputError(
            f"{path}: tables or lists are nested too deep; a spec has five levels"
        ) from None
    except ValueError as error:  # of the syntax, or a number of thousands of digits
        raise InputError(f"{path}: is not valid TOML: {error}") from None
    try:
        body = SpecBody.model_validate(given)
    except ValidationError as error:
        told = [dict(e) for e in error.errors() if not _is_shared(given, e["loc"])]
        lines = [sentence(path, given, SpecBody, e) for e in told]
        raise InputError("\n".join(dict.fromkeys(lines))) from None
    folder = path.resolve().parent
    records = tuple(r.model_copy(update={"file": folder / r.file}) for r in body.records)
    bands = None if body.bands is None else body.bands.beside(folder)
    fields = {name: getattr(body, name) for name in SpecBody.model_fields}
    fields |= {"records": records, "bands": bands, "path": path, "text": text}
    return Spec.model_construct(**fields)


def _is_shared(given: Mapping[str, Any], place: tuple[int | str, ...]) -> bool:
    """Whether a place in a record's channels is in those of its cylinder, where it is told."""
    if len(place) < 3 or place[0] != "records" or place[2] != "channels":
        return False
    return "channels" not in given["records"][place[1]]
