"""The numbers that the paper prints, read from `data/paper/published.toml`."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

from rigid.io.errors import InputError
from rigid.spec.read import EXAMPLES


@dataclass(frozen=True)
class Number:
    """A printed number.

    - `name`: its key. - `symbol`: of the paper; may be empty. - `text`: the digits as printed.
    - `unit`: as printed ("1" for a pure number). - `si`, `si_unit`. - `place`; `note`.
    """

    name: str
    symbol: str
    text: str
    unit: str
    si: float
    si_unit: str
    place: str
    note: str

    @property
    def half_width(self) -> float:
        """Half of what is rounded to the print [SI]: half a unit of its last digit."""
        value = Decimal(self.text)
        exponent = value.as_tuple().exponent
        assert isinstance(exponent, int)
        if value == 0:
            return 0.0
        return 0.5 * 10.0**exponent * abs(self.si / float(value))

    def as_printed(self) -> str:
        """Value and unit as the paper has them."""
        return self.text if self.unit == "1" else f"{self.text} {self.unit}"

    def misprinted(self, si: float) -> "Number":
        """Return the number with another value, for tests that break one on purpose."""
        scale = self.si / float(self.text) if float(self.text) else 1.0
        return replace(self, si=si, text=f"{si / scale:g}")


Numbers = Mapping[str, Number]


def published_file() -> Path:
    """Return where the numbers lie: inside a wheel, or beside the package in a checkout.

    Raises InputError where neither has them.
    """
    tried = [folder.parent / "data" / "paper" / "published.toml" for folder in EXAMPLES]
    for path in tried:
        if path.is_file():
            return path
    raise InputError(
        f"{tried[-1]}: the numbers of the paper are not there; install the package again"
    )


def read_numbers(path: Path | None = None) -> dict[str, Number]:
    """Read all printed numbers by key, in the order of the paper."""
    text = (path or published_file()).read_text(encoding="utf-8")
    entries = tomllib.loads(text, parse_float=str)
    return {
        name: Number(
            name, e["symbol"], str(e["value"]), e["unit"], float(e["si"]), e["si_unit"],
            e["place"], e.get("note", ""),
        )
        for name, e in entries.items()
    }  # fmt: skip
