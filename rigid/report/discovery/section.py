"""The section on discovery: what it is on the page, and its content."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float

from rigid.plots.shown import HiddenShown
from rigid.report.content import Content
from rigid.report.discovery import figures
from rigid.report.discovery.held_out import Turned
from rigid.report.section import Kind

KIND = Kind("discovery", 30, "What is missing", "discovery.html.j2", figures)

Shown = TypeVar("Shown")

MOST_PANELS = 3
"""Channels of which residuals are drawn."""


@dataclass(frozen=True, eq=False)
class ResidualShown:
    """One channel: residuals over what its sheet allows, before and after.

    - `name`; `place` (n,): time [s]; `before`, `after` (n,): smoothed over `smoothed` samples.
    - `explained` (n,): what the effect takes away, smoothed alike; None where it cannot be drawn.
    - `stretch`: where the effect shows, or None.
    - `frequencies`: whether the places are frequencies [Hz], and the residuals their lines' sizes.
    """

    name: str
    place: Float[np.ndarray, " n"]
    before: Float[np.ndarray, " n"]
    after: Float[np.ndarray, " n"]
    smoothed: int
    explained: Float[np.ndarray, " n"] | None = None
    stretch: tuple[float, float] | None = None
    frequencies: bool = False


@dataclass(frozen=True, eq=False)
class AgainstShown:
    """What was left over against what an effect explains, in classes of samples (m,).

    - `explained`: by the effect, once all else was refitted. - `before`, `after`: left over without
      and with it, mean of the class. - `sd`: that noise alone gives such a mean. All of it in
      what a sample of the sensor scatters by its sheet.
    """

    explained: Float[np.ndarray, " m"]
    before: Float[np.ndarray, " m"]
    after: Float[np.ndarray, " m"]
    sd: Float[np.ndarray, " m"]


@dataclass(frozen=True, eq=False)
class ComparedShown:
    """P-values of disagreements between records and predictions.

    - `names`: of the channels. - `over`: what residuals were looked at over.
    - `before`, `after` (channels, over): NaN where there is nothing to look at; `after` is None
      where nothing was added.
    """

    names: tuple[str, ...]
    over: tuple[str, ...]
    before: Float[np.ndarray, "channels over"]
    after: Float[np.ndarray, "channels over"] | None


class Moved(NamedTuple):
    """A quoted number without and with an effect: medians, and by how many sds of the later fit.

    - `name`: of the label, what it belongs to left out.
    """

    label: str
    name: str
    means: str
    unit: str
    before: float
    after: float
    sds: float


@dataclass(frozen=True, eq=False)
class StepContent:
    """One turn: sentences and tables of what was found, added and moved.

    - `sentences`. - `odds`: (name, probability, log Bayes factor, how it was found).
    - `turned`: how sure a first name is, in words, and how others as sure turned out; None where
      no name was given first. - `parameters`: (name, meaning, unit, q05, median, q95). - `moved`:
      quoted numbers.
    - `gaps`: (what, before, after). - `against`, `residuals`, `hidden`: for the figures.
    """

    heading: str
    sentences: tuple[str, ...]
    odds: tuple[tuple[str, float, float, str], ...]
    turned: tuple[str, tuple[Turned, ...]] | None
    parameters: tuple[tuple[str, str, str, float, float, float], ...]
    moved: tuple[Moved, ...]
    gaps: tuple[tuple[str, str, str], ...]
    against: AgainstShown | None
    residuals: tuple[ResidualShown, ...]
    hidden: HiddenShown | None


@dataclass(frozen=True, eq=False, kw_only=True)
class DiscoveryContent(Content):
    """The section, complete.

    - `steps`. - `ending`: what is left at the end.
    - `where`: a sentence on where model and records disagree, and a row for each disagreement:
      (channel, over what, from where to where, p-value, p-value with what was added).
    - `compared`: for the figure. - `bets`: what one would bet before any record, in a sentence.
    - `notes`: on the records as they were read.
    - `names`, `cosines` (n, n): what the records can tell apart. - `pairs`: sentences on it.
    - `noise`: entries of discovery.json, a sensor each.
    - `rejected`: (effect, why, from what size on it would have shown); `shown`: at what strength.
    """

    steps: tuple[StepContent, ...]
    where: tuple[str, tuple[tuple[str, str, str, str, str], ...]]
    compared: ComparedShown
    bets: str
    ending: tuple[str, ...]
    notes: tuple[str, ...]
    names: tuple[str, ...]
    cosines: Float[np.ndarray, "n n"]
    pairs: tuple[str, ...]
    noise: tuple[Mapping[str, Any], ...]
    rejected: tuple[tuple[str, str, str], ...]
    shown: float


def numbered(steps: Iterable[Shown | None]) -> Iterator[tuple[int, Shown]]:
    """What there is to draw of the steps, with the number of each; steps without any left out."""
    return ((number, shown) for number, shown in enumerate(steps, start=1) if shown)
