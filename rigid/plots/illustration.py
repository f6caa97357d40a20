"""A figure as a page shows it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Illustration:
    """A figure in the page: its id, the drawing, what is below it, what stands in for it."""

    key: str
    drawing: str
    caption: str
    alt: str
