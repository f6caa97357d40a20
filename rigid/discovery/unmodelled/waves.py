"""Waves over the stroke: a rough bore, the uneven scale of a sensor.

A wave has a length that no prior knows to within a tenth, and bumps that are wide enough to cover
the stroke average it away. So the residuals of the free runs are searched for the length at which
they beat most over the stroke, as `rigid.discovery.periodic` searches over time; the best of so
many lengths counts for the share of all lengths that it stands for.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import About, AbstractHidden, Bumps, Inferred, none, together
from rigid.discovery.unmodelled.inputs import Input
from rigid.discovery.unmodelled.sensors import SensorError
from rigid.kinds import KINDS
from rigid.localfit.hidden_inputs import STROKE
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import ChannelKey
from rigid.localfit.signature import reads
from rigid.plots.shown import HiddenShown

FREELY = {"slow", "free"}
"""Traits of the records long enough for waves; in a frame a plunger hardly moves."""
SHORTEST = 1e-3
"""Length [m] below which no wave is looked for: what a stroke sensor tells apart."""
LEAST_WAVES = 4.0
"""Waves that must fit into the stroke: longer ones are what bumps are for."""
FINER = 4
"""Lengths tried in one that a stroke tells apart."""
WIDTH = math.sqrt(2.0 * math.pi) * math.sqrt(12.0) / (2.0 * math.pi)
"""A wave of strength s stands out over WIDTH/s of the wave numbers that a stroke tells apart."""


POINTS = 41
"""Of a period that is shown."""


@dataclasses.dataclass(frozen=True)
class Wave(AbstractHidden):
    """A wave over the stroke.

    - `of`: what goes up and down. - `period` [m].
    """

    of: AbstractHidden
    period: float

    sort: ClassVar[str] = "wave"
    order: ClassVar[int] = 3

    @classmethod
    def signatures(cls, fit: Fitted, earlier: Callable[[], Bumps]) -> Bumps:  # noqa: ARG003
        """The wave of every quantity over the stroke.

        Each sensor's rows have a cosine and a sine of their own, in that order; `centre` is the
        number of the sensor.
        """
        return waves(fit.local)

    @property
    def about(self) -> About:
        """What it is."""
        return self.of.about._replace(over=STROKE)

    @property
    def prior_class(self) -> str:
        """A curve over a state."""
        return "curve"

    def shown(self, found: Inferred) -> HiddenShown:
        """One period, on the cylinder where it is the greater."""
        mean, covariance = found.mean, found.covariance
        sizes = np.hypot(mean[::2], mean[1::2])
        mine = 2 * int(np.argmax(sizes)) + np.arange(2)
        place = np.linspace(0.0, self.period, POINTS)
        turn = 2.0 * np.pi * place / self.period
        basis = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        curve = basis @ mean[mine]
        sd = np.sqrt(np.einsum("pi,ij,pj->p", basis, covariance[np.ix_(mine, mine)], basis))
        phase = float(np.arctan2(*mean[mine]))
        words = f"{sizes.max():.3g} sin(2 pi x/{self.period:.3g} {phase:+.2f})"
        return self.drawn(place, curve, sd, curve, words)


WAVING: Mapping[str, AbstractHidden] = {
    "pressure": Input("force", "stroke"),
    "stroke": SensorError("stroke", "stroke"),
    "load": SensorError("load", "stroke"),
}
"""What a wave in a channel is taken for: a gauge does not feel the stroke, the plunger does."""


def waves(local: LocalFit) -> Bumps:
    """Find the wave of every quantity over the stroke, and its signatures."""
    found = [_waving(local, quantity) for quantity in WAVING]
    return together([none(len(local.residual)), *(one for one in found if one is not None)])


def _waving(local: LocalFit, quantity: str) -> Bumps | None:
    """The wave of one quantity, None where no record has both it and the stroke."""
    layout = local.layout
    listed = [c for c in layout.channels if c.quantity == quantity]
    found = [(c, one) for c in listed if (one := _over_stroke(local, c)) is not None]
    if not found:
        return None
    here = [one for _, one in found]
    rows, stroke = (np.concatenate(part) for part in zip(*here, strict=True))
    sensors = np.unique(layout.sensor[rows])
    span = float(np.ptp(stroke))
    low, high = LEAST_WAVES / max(span, 1e-12), min(1.0 / SHORTEST, _most(here))
    if high <= low:
        return None
    tried = math.ceil(span * (high - low))
    numbers = np.linspace(low, high, FINER * tried)
    power = np.zeros(len(numbers))
    for sensor in sensors:
        mine = layout.sensor[rows] == sensor
        power += _power(local, rows[mine], stroke[mine], numbers)
    best = int(np.argmax(power))
    strength = math.sqrt(float(power[best]))
    share = math.log(min(WIDTH / max(strength, 1.0), 1.0) / tried)
    target = Wave(WAVING[quantity], float(1.0 / numbers[best]), log_share=share, tried=tried)
    unit = reads(local)[rows]
    if quantity == "pressure":  # a gauge reads F/S of a force that changes slowly beside the oil
        areas = [_area(local, c.track) for c, _ in found]
        unit /= np.repeat(areas, [len(own) for own, _ in here])
    phase = 2.0 * np.pi * numbers[best] * stroke
    columns = np.zeros((len(local.residual), 2 * len(sensors)))
    for i, sensor in enumerate(sensors):
        mine = layout.sensor[rows] == sensor
        columns[rows[mine], 2 * i] = (unit * np.cos(phase))[mine]
        columns[rows[mine], 2 * i + 1] = (unit * np.sin(phase))[mine]
    return Bumps(columns, (target,) * columns.shape[1], np.repeat(sensors, 2).astype(float))


def _area(local: LocalFit, track: str) -> float:
    """Area that the pressure acts on [m^2]; a machine has one at each joint."""
    values, joint = local.hypothesis.every(local.w), local.hypothesis.problem.track(track).cylinder
    return values.get("S_Pl", values.get(f"area[{joint}]", 1.0))


def _over_stroke(local: LocalFit, channel: ChannelKey) -> tuple[np.ndarray, np.ndarray] | None:
    """Rows of a channel that were read, and the stroke [m] at each; None where it is not known."""
    layout = local.layout
    own = layout.channels.index(channel)
    strokes = [i for i, c in enumerate(layout.channels) if c[:3] == (*channel[:2], "stroke")]
    if not KINDS[channel.kind].traits() >= FREELY or not strokes:
        return None
    rows = np.flatnonzero((layout.channel == own) & layout.read)
    at = layout.channel == strokes[0]
    return rows, np.interp(layout.time[rows], layout.time[at], local.reading[at])


def _most(here: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Greatest wave number [1/m] that the slowest record that moves still samples twice."""
    steps = [np.abs(np.diff(stroke)) for _, stroke in here]
    moving = [float(np.median(s[s > 0.1 * s.max()])) for s in steps if s.max() > 0.0]
    return 0.5 / min(moving) if moving else 0.0


def _power(
    local: LocalFit, rows: np.ndarray, stroke: np.ndarray, numbers: np.ndarray
) -> np.ndarray:
    """Twice the log-likelihood gained by a wave of each number [1/m] (m,), as chi squared of 2."""
    score, weight = local.terms.score[rows], float(local.terms.curvature[rows].sum())
    turned = np.exp(2j * np.pi * np.outer(numbers, stroke)) @ score
    return 2.0 * np.abs(turned) ** 2 / max(weight, 1e-300)
