"""The section on bands: what it is on the page, and its content."""

from dataclasses import dataclass

from rigid.report.content import Content
from rigid.report.section import Kind
from rigid.smoothing.budget import Line

KIND = Kind("bands", 20, "Ice load and displacement", "bands.html.j2")


@dataclass(frozen=True, eq=False)
class FieldContent:
    """One field test.

    - record: its name; budget: its rows
    - events: sentences on falls of the load and movements of the valve
    - files: (name, what it holds) written for it
    """

    record: str
    budget: tuple[Line, ...]
    events: tuple[str, ...]
    files: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class BandsContent(Content):
    """The section on bands, complete.

    - `heads`: names of the parts of the budget.
    - `draws`: of all laws together; `laws`: how many there are; `posterior`: files of the draws.
    """

    heads: tuple[str, ...]
    records: tuple[FieldContent, ...]
    draws: int
    laws: int
    posterior: str
