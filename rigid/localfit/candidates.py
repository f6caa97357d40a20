"""Candidate effects: what could be missing, with shapes drawn from their priors."""

import dataclasses
from collections.abc import Iterable, Mapping
from itertools import product
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import ndtr, ndtri
from jax.typing import ArrayLike
from scipy.stats import norm, qmc

from rigid.effects import AbstractEffect, ParameterInfo
from rigid.likelihood.priors import AbstractPrior, Lognormal, make_prior
from rigid.likelihood.tracks import Track

EVENT, BEGINS = "valve-event", "event_start"
EVENT_SPACING = 0.5
"""Seconds between the instants at which an event of a valve is looked for."""
THIRDS = norm.ppf([1.0 / 6.0, 0.5, 5.0 / 6.0])
"""Midpoints of the three thirds of a prior, on the standard normal scale."""
ABOVE, CLOSE = 40e5, 7e5
"""Pressures [Pa] at which an effect may set in are tried from so far above what the records reach
to so far below, so close to each other; further below, at growing distances."""
GRID = np.linspace(-8.0, 8.0, 6401)


@dataclasses.dataclass(frozen=True)
class Candidate:
    """One way in which one effect could be there.

    - `effect`. - `amplitude`: label of the parameter that brings it in, `absent`: its value there.
    - `prior`: of the amplitude. - `shape`: values of the effect's other parameters, the
      amplitudes where they are absent or a hair beside. - `only`: the record it is confined to,
      "record,cylinder".
    - `level`: amplitude up to which the records are compared, for effects that do not grow in
      proportion; the amplitude is then counted in units of it. None: the slope at absence.
    - `log_share`: log of the share of the shape's prior that it stands for.
    - `priors`: by label, of the numbers that it brings in beside the effect's own.
    - `chance`: where it is the best of many settings, what its log Bayes factor comes to in
      simulated records in which it is not.
    """

    effect: type[AbstractEffect]
    amplitude: str
    absent: float
    prior: AbstractPrior
    shape: Mapping[str, float]
    only: str | None = None
    level: float | None = None
    log_share: float = 0.0
    priors: Mapping[str, AbstractPrior] = dataclasses.field(default_factory=dict)
    chance: tuple[float, ...] = ()

    def departure(self, standard: float) -> float:
        """Value of the amplitude at a quantile of `prior`, on the standard normal scale."""
        value = float(self.prior.from_standard(standard))
        return value if self.level is None else self.absent + value * self.level


LEVELS = (-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5)
"""Quantiles of an amplitude's prior, on the standard normal scale, up to which records are
compared where an effect does not grow in proportion."""

BETWEEN = make_prior("lognormal", {"median": 1.0, "factor": 1.7}, "units of a level")
"""Prior of an amplitude in units of its level."""


HAIR = 1e-9
"""Share of an amplitude's prior by which a slope is taken beside absence."""


class Side(AbstractPrior):
    """The part of a prior above (`sign` 1) or below (-1) its median."""

    prior: AbstractPrior
    sign: float
    name: ClassVar[str] = "side"

    def from_standard(self, z: ArrayLike) -> Array:
        """Map to the quantiles of that half; with growing z away from the median."""
        return self.prior.from_standard(-self.sign * ndtri(0.5 * ndtr(-jnp.asarray(z))))


def _sides(prior: AbstractPrior, absent: float) -> list[tuple[AbstractPrior, float]]:
    """Laws of an amplitude on either side of its absence, and a value a hair beside that."""
    hair = HAIR * float(prior.from_standard(1.0) - prior.from_standard(-1.0))
    off = float(prior.from_standard(0.0)) - absent
    if off != 0.0:
        return [(prior, absent + float(np.copysign(hair, off)))]
    return [(Side(prior, sign), absent + sign * hair) for sign in (1.0, -1.0)]


def _proportional(effect: type[AbstractEffect], prior: AbstractPrior, shaped: bool) -> bool:
    """Whether the records change in proportion to a small amplitude, as far as its prior goes.

    - `shaped`: the effect has other uncertain numbers.
    """
    if effect.gradual():
        return False
    return shaped or effect.steady or bool(effect.scales) or not isinstance(prior, Lognormal)


def _late(effect: type[AbstractEffect]) -> bool:
    """Whether time stamps lag: where the valve switches at a sample, late is not minus early."""
    return effect.delays is not AbstractEffect.delays


def candidates(
    effects: Iterable[type[AbstractEffect]],
    shapes: int,
    given: Mapping[str, AbstractPrior] | None = None,
    seed: int = 0,
) -> tuple[Candidate, ...]:
    """List every amplitude of every effect, with `shapes` settings of the rest.

    The settings are a scrambled Sobol sequence through the priors, so that few of them cover much.

    - `given`: priors by label that go before the effects' own.
    """
    found = []
    for effect in effects:
        priors = priors_of(effect, given or {})
        amplitudes = [label for label, (info, _) in priors.items() if info.absent is not None]
        free = [n for n, (info, prior) in priors.items() if info.absent is None and not prior.known]
        settings = even_settings(len(free), shapes if free else 1, seed)
        for label in amplitudes:
            info, prior = priors[label]
            absent = float(info.absent or 0.0)
            for setting in settings:
                shape = _shape(priors, dict(zip(free, setting, strict=True)))
                if _proportional(effect, prior, bool(free)):
                    sides = _sides(prior, absent) if _late(effect) else [(prior, absent)]
                    found += [
                        Candidate(effect, label, absent, side, shape | {label: beside})
                        for side, beside in sides
                    ]
                    continue
                levels = [float(prior.from_standard(z)) - absent for z in LEVELS]
                found += [Candidate(effect, label, absent, BETWEEN, shape, level=v) for v in levels]
    return tuple(found)


def events(
    effect: type[AbstractEffect],
    tracks: Iterable[Track],
    given: Mapping[str, AbstractPrior] | None = None,
) -> tuple[Candidate, ...]:
    """List events of the valve, one after the other through each record, as long as expected."""
    priors = priors_of(effect, given or {})
    amplitude, absent, prior = amplitude_of(priors)
    found, usual = [], _shape(priors, {})
    begins = next(label for label, (info, _) in priors.items() if info.name == BEGINS)
    for track in tracks:
        elsewhere = effect.place not in ("", track.cylinder)
        if elsewhere or track.drive is None or not any(track.drive.levels):
            continue
        for begin in np.arange(0.0, int(track.samples) * track.interval - 0.2, EVENT_SPACING):
            shape = usual | {begins: float(begin)}
            found.append(Candidate(effect, amplitude, absent, prior, shape, track.label))
    return tuple(found)


def onsets(
    effect: type[AbstractEffect], top: float, given: Mapping[str, AbstractPrior] | None = None
) -> tuple[Candidate, ...]:
    """List pressures at which an effect of known size may set in, from above all records down.

    What it leaves grows from nothing to all within some tens of bar, where records just reach it:
    there they stand close. Each of its other parameters stands at three places of its prior.
    - `top`: greatest pressure in the records [Pa].
    """
    priors = priors_of(effect, given or {})
    assert effect.threshold is not None  # the caller asks
    prior = priors[effect.threshold][1]
    amplitude, absent, size = amplitude_of(priors)
    places, step = [top + ABOVE], CLOSE
    while places[-1] - step > float(prior.from_standard(-3.0)):
        places.append(places[-1] - step)
        step = CLOSE if places[-1] > top - ABOVE else 1.5 * step
    found = np.array(places)
    edges = np.concatenate([[found[0] + CLOSE], 0.5 * (found[1:] + found[:-1]), [0.0]])
    mass = -np.diff(norm.cdf([standard_of(prior, edge) for edge in edges]))
    inside = np.flatnonzero(mass > 0.0)
    shares = np.log(mass[inside] * len(inside) / mass[inside].sum())
    level = float(size.from_standard(0.0)) - absent
    own = [n for n in priors if n not in (amplitude, effect.threshold) and not priors[n][1].known]
    shapes = [
        _shape(priors, dict(zip(own, at, strict=True))) for at in product(THIRDS, repeat=len(own))
    ]
    return tuple(
        Candidate(
            effect, amplitude, absent, BETWEEN, shape | {effect.threshold: places[i]},
            level=level, log_share=float(share),
        )
        for shape in shapes
        for i, share in zip(inside, shares, strict=True)
    )  # fmt: skip


def standard_of(prior: AbstractPrior, value: float) -> float:
    """Quantile of a value under a prior, on the standard normal scale."""
    return float(all_standard_of(prior, np.asarray(value)))


def all_standard_of(prior: AbstractPrior, values: np.ndarray) -> np.ndarray:
    """Quantiles of values of any shape under a prior, on the standard normal scale."""
    known = np.asarray(prior.from_standard(GRID))
    rising = known[-1] >= known[0]  # a lognormal prior of negative values falls
    grid = GRID if rising else GRID[::-1]
    return np.asarray(np.interp(values, known if rising else known[::-1], grid))


def priors_of(
    effect: type[AbstractEffect], given: Mapping[str, AbstractPrior]
) -> dict[str, tuple[ParameterInfo, AbstractPrior]]:
    """Each parameter of an effect by label, with its prior; one that is `given` goes before."""
    return {
        label: (
            info,
            given.get(label)
            or given.get(info.name)
            or make_prior(prior.law, prior.arguments, label),
        )
        for info in effect.parameters()
        for label, prior in zip(info.labels, info.priors, strict=True)
    }


def amplitude_of(
    priors: Mapping[str, tuple[ParameterInfo, AbstractPrior]],
) -> tuple[str, float, AbstractPrior]:
    """The first number that brings an effect in: label, value where it is absent, prior."""
    return next(
        (label, float(info.absent), prior)
        for label, (info, prior) in priors.items()
        if info.absent is not None
    )


def even_settings(dimension: int, count: int, seed: int) -> np.ndarray:
    """Standard normal points (count, dimension) that fill their space evenly."""
    if dimension == 0:
        return np.zeros((1, 0))
    points = qmc.Sobol(dimension, rng=seed).random(1 << (count - 1).bit_length())[:count]
    return norm.ppf(np.clip(points, 1e-3, 1.0 - 1e-3))


def quiet_values(effect: type[AbstractEffect]) -> dict[str, float]:
    """Parameters of an effect by label: amplitudes where it is absent, the rest at the median."""
    return _shape(priors_of(effect, {}), {})


def _shape(
    priors: Mapping[str, tuple[ParameterInfo, AbstractPrior]], standard: Mapping[str, float]
) -> dict[str, float]:
    """Values of all parameters of an effect; its amplitudes are absent."""
    out = {}
    for label, (info, prior) in priors.items():
        absent = info.absent
        value = prior.from_standard(standard.get(label, 0.0)) if absent is None else absent
        out[label] = float(value)
    return out
