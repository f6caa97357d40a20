"""The section on published numbers: what it is on the page, and its content."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from rigid.plots.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILION
from rigid.report.content import Content
from rigid.report.published import figures
from rigid.report.section import Kind

KIND = Kind("stories", 12, "What the published numbers say", "stories.html.j2", figures)

COLOURS = (INK, GREY, SKY, PURPLE, BLUE, GREEN, VERMILION, ORANGE, "#7a5c00", "#8aa29e")
"""Of the stories, in their order."""

COMPUTED = "computed, not measured"
BANDS = "Bands hold 50 and 90 % of the posterior under the catalogue prior."


@dataclass(frozen=True, eq=False)
class StoryShown:
    """A story as the figures need it.

    - `key`, `title`. - `factors`: (ln Bayes factor, Monte Carlo error) by prior.
    - `root` (n,): omega/omega_0 of the strongest oscillation in draws.
    - `acceleration` (5, times) [m/s^2]: quantiles of what the accelerometer would record.
    """

    key: str
    title: str
    factors: tuple[tuple[str, float, float], ...]
    root: Complex[np.ndarray, " n"]
    acceleration: Float[np.ndarray, "5 times"]


@dataclass(frozen=True, eq=False)
class CauseShown:
    """A cause of the pressure in free running: p (5, speeds) [Pa], quantiles, by cylinder."""

    title: str
    pressure: tuple[tuple[str, Float[np.ndarray, "5 speeds"]], ...]


@dataclass(frozen=True, eq=False)
class StoriesShown:
    """All that the figures show.

    - `time` [s]: of the accelerations; `period` [s], `duration` [s]: as printed.
    - `omega_0` [rad/s]: below eq. (14). - `path` (roots, m): of eq. (14) as printed while mu grows;
      `printed_roots`: by name.
    - `speeds` [m/s]; `borrowed`: (cylinder, speed, p) from the printed kappa and mu.
    - `stroke`: (cylinder, (5, times) [m]) over `run_time` [s].
    """

    stories: tuple[StoryShown, ...]
    time: Float[np.ndarray, " times"]
    period: float
    duration: float
    omega_0: float
    path: Complex[np.ndarray, "roots m"]
    printed_roots: tuple[tuple[str, Complex[np.ndarray, " k"]], ...]
    speeds: Float[np.ndarray, " speeds"]
    causes: tuple[CauseShown, ...]
    borrowed: tuple[tuple[str, float, float], ...]
    run_time: Float[np.ndarray, " run"]
    stroke: tuple[tuple[str, Float[np.ndarray, "5 run"]], ...]


@dataclass(frozen=True)
class StoryRow:
    """One story or cause in words; `needs`: its own numbers given what is printed."""

    title: str
    assumes: str
    needs: tuple[str, ...]
    decides: str


@dataclass(frozen=True)
class PrintedRow:
    """One printed number: name, as printed, what the printing allows, place and reason."""

    name: str
    value: str
    allows: str
    place: str
    why: str


@dataclass(frozen=True, eq=False, kw_only=True)
class StoriesContent(Content):
    """The section, complete.

    `says`: in short. `tables`: (heading, heads, rows) of evidence by prior or reading.
    """

    says: tuple[str, ...]
    printed: tuple[PrintedRow, ...]
    stories: tuple[StoryRow, ...]
    causes: tuple[StoryRow, ...]
    tables: tuple[tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]], ...]
    shown: StoriesShown
