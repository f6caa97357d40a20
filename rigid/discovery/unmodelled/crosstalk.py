"""Sensors that answer to something else than what they are for.

A gauge before a hose reads the flow as well, a stroke sensor its own speed where it lags, a load
cell the pressure that bends its seat. Motion knows nothing of that, so that the traces need no
simulation: they are what the other sensors of the record are expected to read, and how fast that
changes.
"""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import ClassVar

import numpy as np
from jaxtyping import Float, Int

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import About, AbstractHidden, Bumps, Inferred, none, together
from rigid.discovery.unmodelled.sensors import distorted
from rigid.localfit.hidden_inputs import Abscissa
from rigid.localfit.samples import ChannelKey
from rigid.physics.sensors import UNITS
from rigid.plots.shown import HiddenShown


@dataclasses.dataclass(frozen=True)
class Crosstalk(AbstractHidden):
    """The sensors of a quantity answer to others, in all records alike.

    - `kind`: the quantity. - `rates`: whether to how fast the others change. - `sources`: them.
    """

    kind: str
    rates: bool
    sources: tuple[str, ...]

    sort: ClassVar[str] = "crosstalk"
    order: ClassVar[int] = 6

    @classmethod
    def signatures(cls, fit: Fitted, earlier: Callable[[], Bumps]) -> Bumps:  # noqa: ARG003
        """What every quantity would read of the others."""
        layout = fit.local.layout
        return answering(layout.channels, layout.channel, layout.time, fit.local.reading)

    @property
    def about(self) -> About:
        """What it is."""
        over = Abscissa("the most in any record, by what it answers to", "1")
        return distorted(self.kind, over)

    @property
    def prior_class(self) -> str:
        """In proportion to what it answers to."""
        return "straight"

    def shown(self, found: Inferred) -> HiddenShown:
        """How much it reads of each other quantity, at the most that the records hold of it."""
        most = np.abs(found.own.columns).max(axis=0)
        units = [UNITS.get(other, "1") + "/s" * self.rates for other in self.sources]
        names = tuple(f"{'rate of ' * self.rates}{other}" for other in self.sources)
        told = ", ".join(
            f"{number:.3g} {self.about.unit} per {unit} of the {name}"
            for number, unit, name in zip(found.mean, units, names, strict=True)
        )
        mean, sd, none_of_it = found.mean * most, found.sd * most, np.zeros(len(names))
        shown = self.drawn(found.own.centre, mean, sd, none_of_it, told)
        model = "it answers to its own quantity alone"
        return dataclasses.replace(shown, groups=names, model=model)


def answering(
    channels: Sequence[ChannelKey],
    channel: Int[np.ndarray, " n"],
    time: Float[np.ndarray, " n"],
    reading: Float[np.ndarray, " n"],
) -> Bumps:
    """Signatures of all crosstalk, per unit of a quantity or of its rate.

    - `channel`: number of each sample's; `time` [s]; `reading`: what it should read. `centre` is
      the number of the source.
    """
    rows = {(c.track, c.quantity): np.flatnonzero(channel == n) for n, c in enumerate(channels)}
    parts = [none(len(reading))]
    listed = quantities(channels)
    for kind in listed:
        others = tuple(q for q in listed if q != kind)
        for rates, sources in ((False, others), (True, listed)):
            signatures = np.zeros((len(reading), len(sources)))
            for mine, series in _beside(rows, kind):
                for i, source in enumerate(sources):
                    if source in series:
                        seen = reading[series[source]]
                        when = time[series[source]]
                        seen = np.gradient(seen, when) if rates else seen
                        signatures[mine, i] = np.interp(time[mine], when, seen)
            target = Crosstalk(kind, rates, sources)
            numbers = np.arange(len(sources), dtype=float)
            parts.append(Bumps(signatures, (target,) * len(sources), numbers))
    return together(parts)


def quantities(channels: Sequence[ChannelKey]) -> tuple[str, ...]:
    """Quantities that some record has beside others, in order."""
    read: dict[str, set[str]] = {}
    for one in channels:
        read.setdefault(one.track, set()).add(one.quantity)
    return tuple(dict.fromkeys(c.quantity for c in channels if len(read[c.track]) > 1))


def _beside(
    rows: dict[tuple[str, str], np.ndarray], kind: str
) -> Iterator[tuple[np.ndarray, dict[str, np.ndarray]]]:
    """Rows of a quantity in every record, and those of all quantities of that record."""
    for (track, quantity), mine in rows.items():
        if quantity == kind:
            yield mine, {q: found for (t, q), found in rows.items() if t == track}
