"""Where records and predictions disagree: per record and channel, over time, lag, frequency, state.

Every statement has a p-value among campaigns of the fitted model, whose noise is as correlated as
here and whose parameters are fitted, and one that counts all statements that were tried: how often
the least of all p-values is as small (Westfall and Young 1993, Resampling-Based Multiple Testing).
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, norm

from rigid.localfit.local import LocalFit
from rigid.localfit.motions import course_of, followed, held_against
from rigid.localfit.noise.leftover import Traces
from rigid.localfit.noise.simulated import Campaigns
from rigid.localfit.samples import ChannelKey

BLOCKS, BINS, LAGS = 12, 8, 20
"""Stretches of a record, classes of a state, lags in samples that are looked at."""
FINE = 64
"""Classes of a state in one channel, of which those of all channels together are made."""
LEAST_SAMPLES = 60
"""Of a channel that is looked at."""
MOVING = ("stroke", "position")
"""Quantities whose rate is a speed."""
ALL = "all records"
"""In place of a record, where all channels of a quantity are looked at together."""
TIME, FREQUENCY, LAG, SPEED = "time", "frequency", "lag", "speed"
ROUNDING = 1e-6
"""Share of a state's greatest size below which it is nothing."""
LARGE = 20.0
"""Minus the log of a p-value so small that the least of many is as many times it."""


class Disagreement(NamedTuple):
    """One statement: residuals of a channel are too large over something, and where they are most.

    - `record`: "record,cylinder", or ALL; `quantity`: of the channel. - `over`: "time", "lag",
      "frequency", "speed" or a quantity. - `where`: from and to [SI]. - `alone`: p-value if nothing
      else were looked at; `p_value`: with all that was.
    """

    record: str
    quantity: str
    over: str
    where: tuple[float, float]
    alone: float
    p_value: float


class Look(NamedTuple):
    """One channel looked at over one thing.

    - `log_p`: of the records, then of every simulated campaign. - `where`: of the former.
    """

    over: str
    log_p: Float[np.ndarray, " 1+draws"]
    where: tuple[float, float]


def disagreements(local: LocalFit, traces: Traces, seed: int) -> tuple[Disagreement, ...]:
    """Compare every channel with what is expected of it, the surest disagreement first.

    - `local`: a fit. - `traces`: of all that may be missing, so that none of it is taken for noise.
    """
    layout = local.layout
    channels = layout.channels
    campaigns = Campaigns.of(local, traces, seed)
    pools = {q: Pool() for q in dict.fromkeys(c.quantity for c in channels)}
    names, found = [], []
    for number, channel in enumerate(channels):
        rows = np.flatnonzero((layout.channel == number) & (local.terms.curvature > 0.0))
        if len(rows) < LEAST_SAMPLES:
            continue
        series = np.concatenate([local.terms.score[rows, None], campaigns.left(number, rows)], 1)
        series /= np.sqrt(np.mean(local.terms.curvature[rows]))
        states = states_of(local, channels, channel, rows)
        pools[channel.quantity].add(series, states)
        for look in looks(series, layout.time[rows], channel.interval, states):
            names.append(channel)
            found.append(look)
    for quantity, pool in pools.items():
        together = ChannelKey(ALL, "", quantity, quantity, 0.0)
        for look in pool.looks():
            names.append(together)
            found.append(look)
    return judged(names, found)


class Pool:
    """Residuals of all channels of a quantity by the states they go by.

    Sums over classes of each channel that are so fine that those of all can be put together later:
    what a state reaches is known only once all records have been seen.
    """

    def __init__(self) -> None:
        self._sums: dict[str, list[np.ndarray]] = {}
        self._spans: dict[str, list[np.ndarray]] = {}

    def add(self, series: np.ndarray, states: Mapping[str, np.ndarray]) -> None:
        """Take a channel's residuals (n, 1 + draws) and states (n,)."""
        count = min(FINE, len(series))
        edges = np.linspace(0, len(series), count + 1).astype(int)
        for name, state in states.items():
            order = np.argsort(state, kind="stable")
            sums = np.add.reduceat(series[order], edges[:-1], axis=0)
            self._sums.setdefault(name, []).append(sums)
            self._spans.setdefault(name, []).append(
                np.stack([state[order[edges[:-1]]], state[order[edges[1:] - 1]], np.diff(edges)], 1)
            )

    def looks(self) -> Iterator[Look]:
        """Look at the quantity over every state in which two channels or more have their say."""
        for name, parts in self._sums.items():
            if len(parts) < 2:
                continue
            sums, spans = np.concatenate(parts), np.concatenate(self._spans[name])
            order = np.argsort(spans[:, :2].mean(axis=1), kind="stable")
            reached = np.cumsum(spans[order, 2])
            group = np.minimum((BINS * (reached - 1) / reached[-1]).astype(int), BINS - 1)
            firsts = np.flatnonzero(np.diff(group, prepend=-1))
            log_p, at = _least(_two_sided(_standard(np.add.reduceat(sums[order], firsts, axis=0))))
            mine = spans[order[group == group[firsts[at]]]]
            yield Look(name, log_p, _rounded((mine[:, 0].min(), mine[:, 1].max()), spans[:, :2]))


def judged(channels: list[ChannelKey], tests: list[Look]) -> tuple[Disagreement, ...]:
    """Give every test its p-values, alone and among all; the least first."""
    if not tests:
        return ()
    logs = np.stack([test.log_p for test in tests])
    least, count = logs[:, 1:].min(axis=0), logs.shape[1]
    found = []
    for channel, test, mine in zip(channels, tests, logs, strict=True):
        alone = (1 + np.sum(mine[1:] <= mine[0])) / count
        among = (1 + np.sum(least <= mine[0])) / count
        found.append(
            Disagreement(
                channel.track, channel.quantity, test.over, test.where, float(alone), float(among)
            )
        )
    order = np.argsort(logs[:, 0], kind="stable")
    return tuple(found[i] for i in order)


def looks(
    series: np.ndarray, time: np.ndarray, interval: float, states: dict[str, np.ndarray]
) -> Iterator[Look]:
    """All tests of one channel.

    - `series` (n, 1 + draws): residuals in sds, of the records and of simulated campaigns. - `time`
      (n,), `interval` [s]. - `states`: what the channel may go by, (n,) each.
    """
    yield _over_classes(TIME, series, time, BLOCKS)
    for name, state in states.items():
        yield _over_classes(name, series, state, BINS)
    power = np.abs(np.fft.rfft(series, axis=0)[1:]) ** 2
    frequency = np.fft.rfftfreq(len(series), interval)[1:]
    usual = power[:, 1:].mean(axis=1, keepdims=True)
    log_p, at = _least(_of_power(power / np.maximum(usual, 1e-300), len(series)))
    yield Look(FREQUENCY, log_p, (float(frequency[at]), float(frequency[at])))
    products = np.stack([np.mean(series[k:] * series[:-k], axis=0) for k in range(1, LAGS + 1)])
    products /= np.mean(series**2, axis=0)
    log_p, at = _least(_two_sided(_standard(products)))
    yield Look(LAG, log_p, ((at + 1) * interval, (at + 1) * interval))


def _of_power(power: np.ndarray, samples: int) -> np.ndarray:
    """Log p-values of power (m, columns) over its mean; half the sampling rate has no phase."""
    log_p = -power
    if samples % 2 == 0:
        log_p[-1] = chi2.logsf(power[-1], 1)
    return log_p


def _over_classes(over: str, series: np.ndarray, state: np.ndarray, count: int) -> Look:
    """Means of residuals in classes of a state, each with as many samples."""
    order = np.argsort(state, kind="stable")
    edges = np.linspace(0, len(order), count + 1).astype(int)
    sums = np.add.reduceat(series[order], edges[:-1], axis=0)
    log_p, at = _least(_two_sided(_standard(sums)))
    mine = state[order[edges[at] : edges[at + 1]]]
    return Look(over, log_p, _rounded((mine[0], mine[-1]), state))


def _rounded(ends: Iterable[float], state: np.ndarray) -> tuple[float, float]:
    """Ends of a class; a load that starts from 0 is -2e-15 N by the rounding of the solver."""
    least = ROUNDING * float(np.abs(state).max())
    low, high = (0.0 if abs(end) < least else float(end) for end in ends)
    return low, high


def _standard(values: np.ndarray) -> np.ndarray:
    """Values (m, 1 + draws) over the mean and sd that simulated campaigns have."""
    null = values[:, 1:]
    sd = np.maximum(null.std(axis=1, keepdims=True), 1e-300)
    return (values - null.mean(axis=1, keepdims=True)) / sd


def _two_sided(values: np.ndarray) -> np.ndarray:
    return np.log(2.0) + norm.logsf(np.abs(values))


def _least(logs: np.ndarray) -> tuple[np.ndarray, int]:
    """Log p-value (columns,) of the least of m (m, columns), and which it is in the first."""
    least = logs.min(axis=0)
    many = np.log(len(logs)) + least
    within = np.clip(least, -LARGE, -1e-12)
    exact = np.log(-np.expm1(len(logs) * np.log1p(-np.exp(within))))
    return np.where(least < -LARGE, many, exact), int(np.argmin(logs[:, 0]))


def states_of(
    local: LocalFit, channels: tuple[ChannelKey, ...], channel: ChannelKey, rows: np.ndarray
) -> dict[str, np.ndarray]:
    """What a channel's residuals may go by (n,): expected quantities of its record, the speed.

    Where a motion was measured: it, and the force that was read.
    """
    layout, found = local.layout, {}
    time, course = layout.time[rows], course_of(layout.problem.track(channel.track))
    if course is not None:
        return {channel.quantity: held_against(local)[rows], **followed(course, time)}
    for number, other in enumerate(channels):
        if other.track != channel.track:
            continue
        mine = np.flatnonzero(layout.channel == number)
        values, when = local.reading[mine], layout.time[mine]
        if other.quantity in MOVING:
            found[SPEED] = np.interp(time, when, np.gradient(values, when))
        found[other.quantity] = np.interp(time, when, values)
    return found
