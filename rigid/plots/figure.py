"""A figure with all that goes with it, and the form that a page takes it in."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure

Columns = Mapping[str, np.ndarray]
"""Numbers behind a figure: a heading with its unit, "time [s]", and the values below it."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A figure as its file made it.

    - `name`: of its files; letters, digits, hyphens; no other figure of the section has it.
    - `figure`: made by `new_figure`. - `caption`; `alt`: what stands in for it, a sentence.
    - `numbers`: what is drawn, as columns of any lengths; text where there is no number.
    """

    name: str
    figure: Figure
    caption: str
    alt: str
    numbers: Columns = field(default_factory=dict)


@dataclass(frozen=True)
class Illustration:
    """A figure as a page shows it: id, drawing, caption, what stands in for it, names of files."""

    key: str
    drawing: str
    caption: str
    alt: str
    files: tuple[str, ...] = ()
