"""Self-recording accelerometers: a preamble of lines that begin with ;, then counts."""

from pathlib import Path

from rigid.io.errors import InputError
from rigid.records.delimited import split
from rigid.records.table import Table, build

COMMENT = ";"
HEADERS = "headers"


def parse(path: Path, text: str) -> Table:
    """Return the table; the axes are in counts of the converter.

    Lines that begin with ; are passed over wherever they stand; the one that begins with
    `;Headers,` names the columns.

    Raises InputError when no line names the columns or the rows do not fit.
    """
    lines = text.split("\n")
    names = names_of(lines)
    if names is None:
        raise InputError(
            f"{path}: no line begins with ';Headers,' to name the columns; "
            "add one, such as ';Headers, time,Ax,Ay,Az'"
        )
    body, numbers = split(path, lines, ",", comment=COMMENT)
    return build(path, names, body, numbers)


def is_preamble(text: str) -> bool:
    """Whether a text begins as these recorders do: its first two lines are comments."""
    return all(line.startswith(COMMENT) for line in text.split("\n", 2)[:2])


def names_of(lines: list[str]) -> list[str] | None:
    """Return the names of the columns, None where no line gives them."""
    for line in lines:
        head, *names = line.removeprefix(COMMENT).split(",")
        if line.startswith(COMMENT) and head.strip().lower() == HEADERS and names:
            return [name.strip() for name in names]
    return None
