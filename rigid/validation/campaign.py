"""A campaign drawn from a spec's own model: its records with other readings.

Sampling instants, valve programmes, gaps, sensors and converters are those of the records; what the
sensors read is that of the model at a draw of the prior, with gain, zero, noise and rounding as the
likelihood states them. The readings pass the same checks as a file's. A campaign that the readers
refuse is drawn anew: they look at readings alone, so that truths stay draws of the posterior given
what was kept.
"""

import dataclasses
from collections.abc import Mapping
from functools import cached_property

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.signal import lfilter

from rigid.io.errors import InputError
from rigid.likelihood.assemble import assemble
from rigid.likelihood.channels import SensorSheet
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.priors import AbstractPrior, Lognormal, Normal
from rigid.likelihood.problem import Problem, in_batches, predict
from rigid.likelihood.tracks import Track
from rigid.records.converter import without_ends
from rigid.records.read import read_records, reread
from rigid.records.record import Record
from rigid.spec import Spec
from rigid.validation.design import Design

MOST_TRIES, AT_ONCE = 48_000, 240
"""Draws that the readers may refuse, one after the other, and how many are simulated together."""
BEYOND, FOR_LONG = 1.02, 100
"""Readings that are so many ranges from 0 in so many samples stand at the end of the range,
whatever the noise: the readers refuse them."""
GRID = np.linspace(-8.0, 8.0, 8001)
"""Of a standard normal, on which a law is inverted; between its points a law is straight to 1e-6 of
its width."""


@dataclasses.dataclass(frozen=True, eq=False)
class Base:
    """A spec with its records, from which campaigns are drawn.

    - `problem`: of the records as they are, priors moved where the design says so.
    """

    spec: Spec
    records: tuple[Record, ...]
    problem: Problem


@dataclasses.dataclass(frozen=True, eq=False)
class Campaign:
    """A campaign and what made it.

    - `records`, `problem`: as a fit meets them. - `z` (size,): the truth in that problem.
    - `sensors`: true gain and zero by "quantity,cylinder". - `refused`: draws before this one.
    - `shifted`: label and z of the constant that was drawn from elsewhere, None: none was.
    """

    records: tuple[Record, ...]
    problem: Problem
    z: np.ndarray
    sensors: Mapping[str, tuple[float, float]]
    refused: int
    shifted: tuple[str, float] | None


def read_base(spec: Spec, around: Mapping[str, tuple[float, float]]) -> Base:
    """Read the records of a spec and put its problem together.

    - `around`: centre and width of priors that are moved, by label.
    """
    records = read_records(spec)
    return Base(spec, records, moved(assemble(spec, records), around))


def moved(problem: Problem, around: Mapping[str, tuple[float, float]]) -> Problem:
    """Return a problem with priors moved; other laws than normal and lognormal stay.

    - `around`: centre and width by label, in sds of the prior as it was.
    """
    if not around:
        return problem
    sampled = tuple(
        dataclasses.replace(p, prior=_moved(p.prior, *around[p.label])) if p.label in around else p
        for p in problem.parameters.sampled
    )
    parameters = Parameters(sampled, problem.parameters.known)
    return eqx.tree_at(lambda q: q.parameters, problem, parameters)


def _moved(law: AbstractPrior, centre: float, width: float) -> AbstractPrior:
    if isinstance(law, Lognormal):
        return Lognormal(law.median * law.factor**centre, law.factor**width)
    if isinstance(law, Normal):
        return Normal(law.mean + law.sd * centre, law.sd * width)
    return law


def constants(base: Base) -> tuple[str, ...]:
    """Labels of the uncertain constants of the rig: those that a design can draw from elsewhere."""
    known = set(base.spec.rig.known)
    return tuple(p.label for p in base.problem.parameters.sampled if p.base in known)


def draw(base: Base, design: Design, number: int) -> Campaign:
    """Draw the campaign of a replicate.

    Raises InputError where the readers refuse one draw after the other.
    """
    shifted = _shift(base, design, number)
    says, tried = "a sensor is far beyond the end of its range", 0
    while tried < MOST_TRIES:
        rng = np.random.default_rng([design.seed, number, tried])
        z = rng.standard_normal((AT_ONCE, base.problem.parameters.size))
        if shifted is not None:
            z[:, base.problem.parameters.index(shifted[0])] = shifted[1]
        ideal, possible = _screened(base, z)
        for row in np.flatnonzero(possible):
            true = {
                label: {q: series[:, row] for q, series in read.items()}
                for label, read in ideal.items()
            }
            made = _Made(base, design, z[row], _sensors(base.problem, rng), true)
            noise = np.random.default_rng([design.seed, number, tried, int(row)])
            try:
                records, problem = made.measured(noise)
            except InputError as error:
                says = str(error).splitlines()[0]
                continue
            truth = restated(base.problem, problem, z[row])
            refused = tried + int(row)
            return Campaign(records, problem, truth, made.sensors, refused, shifted)
        tried += AT_ONCE
    raise InputError(
        f"{base.spec.path}: {MOST_TRIES} campaigns drawn from the prior were refused one after the "
        f"other as no records of this rig; the last: {says}; narrow the priors that lead there, or "
        "draw with --from POSTERIOR"
    )


def measured(
    base: Base,
    design: Design,
    z: np.ndarray,
    sensors: Mapping[str, tuple[float, float]],
    rng: np.random.Generator,
) -> tuple[tuple[Record, ...], Problem]:
    """Return records and problem that a given truth makes, and the readers take.

    - `z` (size,); `sensors`: true gain and zero by "quantity,cylinder".

    Raises InputError where they do not.
    """
    ideal, _ = _screened(base, z[None])
    true = {label: {q: s[:, 0] for q, s in read.items()} for label, read in ideal.items()}
    return _Made(base, design, z, sensors, true).measured(rng)


def _screened(base: Base, z: np.ndarray) -> tuple[dict[str, dict[str, np.ndarray]], np.ndarray]:
    """Simulate draws and say which of them the readers might take.

    - `z` (n, size).

    Returns ideal readings by track and quantity, (samples, n), and (n,) bool: a sensor far beyond
    its range for long is refused for sure.
    """
    parts = in_batches(predict, base.problem, z)
    ideal: dict[str, dict[str, np.ndarray]] = {}
    possible = np.ones(len(z), dtype=bool)
    for number, group in enumerate(base.problem.groups):
        for i, track in enumerate(group.tracks):
            ideal[track.label] = {}
            for quantity in group.quantities:
                rows = [
                    groups[number][quantity][: int(track.samples), i, :n] for groups, n in parts
                ]
                series = np.concatenate(rows, axis=1)
                ideal[track.label][quantity] = series
                low, high = base.spec.sensors[quantity].range
                with np.errstate(invalid="ignore"):
                    beyond = (series > BEYOND * high) | ((low < 0.0) & (series < BEYOND * low))
                possible &= np.isfinite(series).all(axis=0) & (beyond.sum(axis=0) < FOR_LONG)
    return ideal, possible


def _shift(base: Base, design: Design, number: int) -> tuple[str, float] | None:
    """Which constant a replicate draws from elsewhere: each in turn, to either side."""
    if not design.shift:
        return None
    listed = constants(base)
    if not listed:
        raise InputError(f"{base.spec.path}: no constant of the rig is uncertain; nothing to shift")
    turn, place = divmod(number, len(listed))
    return listed[place], design.shift * (-1) ** turn


def _sensors(problem: Problem, rng: np.random.Generator) -> dict[str, tuple[float, float]]:
    """Draw gain and zero of every sensor."""
    spreads = {p.sensor(i): p.sheet.spread for p in problem.pieces for i in range(len(p.tracks))}
    drawn = rng.standard_normal((len(problem.sensors), 2))
    return {
        label: (spreads[label].gain * float(a), spreads[label].zero * float(b))
        for label, (a, b) in zip(problem.sensors, drawn, strict=True)
    }


@dataclasses.dataclass(frozen=True, eq=False)
class _Made:
    """A draw on its way to a campaign.

    - `z` (size,); `sensors`: gain and zero. - `ideal`: what perfect sensors read, by track and
      quantity (samples,).
    """

    base: Base
    design: Design
    z: np.ndarray
    sensors: Mapping[str, tuple[float, float]]
    ideal: Mapping[str, Mapping[str, np.ndarray]]

    def measured(self, rng: np.random.Generator) -> tuple[tuple[Record, ...], Problem]:
        """Records and problem of the campaign; raises InputError where the readers refuse it."""
        spec, tracks = self.base.spec, {t.label: t for t in self.base.problem.tracks}
        stated = {(r.name, r.cylinder): r for r in spec.records}
        records = []
        for record in self.base.records:
            track = tracks[f"{record.name},{record.cylinder}"]
            seen = {} if track.of.filtered else self._seen(record, track, rng)
            one = stated[record.name, record.cylinder]
            records.append(reread(record, seen, one, spec.sensors) if seen else record)
        listed = without_ends(records, spec.sensors)
        problem = moved(assemble(spec, listed), self.design.around)
        return listed, self._with_forces(problem, rng)

    def _seen(self, record: Record, track: Track, rng: np.random.Generator) -> dict:
        """Readings of a record's sensors, by quantity (n,)."""
        true = self.ideal[track.label]
        return {
            q: self._read(q, record.cylinder, at_samples(record, track, true[q]), rng)
            for q in record.channels
            if q in true and f"{q},{record.cylinder}" in self.sensors
        }

    def _read(
        self, quantity: str, cylinder: str, true: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """What a sensor and its converter make of true values (n,)."""
        sensor = f"{quantity},{cylinder}"
        gain, zero = self.sensors[sensor]
        noise = self._levels[f"noise[{sensor}]"] * coloured(rng, len(true), self.design.colour)
        sheet = next(p.sheet for p in self.base.problem.pieces if p.quantity == quantity)
        low, high = self.base.spec.sensors[quantity].range
        return np.clip(converted((1.0 + gain) * true + zero + noise, sheet), low, high)

    @cached_property
    def _levels(self) -> dict[str, float]:
        """Values of all parameters, among them the noise of every sensor."""
        values = self.base.problem.parameters.values(jnp.asarray(self.z[None]))
        return {label: float(value[0]) for label, value in values.items()}

    def _with_forces(self, problem: Problem, rng: np.random.Generator) -> Problem:
        """Put forces in the place of those of motions, which are explained behind their filter."""
        pieces = []
        for piece in problem.pieces:
            tracks = [problem.groups[piece.group].tracks[t] for t in piece.tracks]
            if not tracks[0].of.filtered:
                pieces.append(piece)
                continue
            data = np.array(piece.data)
            for i, track in enumerate(tracks):
                force = self.ideal[track.label][piece.quantity]
                data[: len(force), i] = self._read(piece.quantity, track.cylinder, force, rng)
            pieces.append(dataclasses.replace(piece, data=data))
        return dataclasses.replace(problem, pieces=tuple(pieces))


def at_samples(record: Record, track: Track, series: np.ndarray) -> np.ndarray:
    """Series of a track at the samples of its record; 0 where the track does not reach."""
    at = np.round((record.time - float(track.first)) / track.interval).astype(int)
    inside = (at >= 0) & (at < len(series))
    return np.where(inside, series[np.clip(at, 0, len(series) - 1)], 0.0)


def coloured(rng: np.random.Generator, n: int, colour: float) -> np.ndarray:
    """Noise (n,) of unit variance, neighbours correlated by `colour`."""
    white = rng.standard_normal(n)
    if colour == 0.0:
        return white
    white[1:] *= np.sqrt(1.0 - colour**2)
    return np.asarray(lfilter([1.0], [1.0, -colour], white))


def converted(reading: np.ndarray, sheet: SensorSheet) -> np.ndarray:
    """What a converter makes of readings."""
    return np.round(reading / sheet.step) * sheet.step if sheet.step > 0.0 else reading


def restated(old: Problem, new: Problem, z: np.ndarray) -> np.ndarray:
    """Return z (size,) of the same values where laws of a problem hang on what was read.

    A release's instant has its prior around the sample at which the record jumps. A value beyond a
    law lies at the end of GRID.
    """
    mine = old.parameters.values(jnp.asarray(z[None]))
    theirs = new.parameters.values(jnp.asarray(z[None]))
    out = z.copy()
    for i, one in enumerate(new.parameters.sampled):
        value = float(mine[one.label][0])
        if not np.isclose(value, float(theirs[one.label][0]), rtol=1e-12, atol=0.0):
            out[i] = standard(one.prior, np.array([value]))[0]
    return out


def standard(law: AbstractPrior, values: np.ndarray) -> np.ndarray:
    """Standard normal (n,) that a law maps to values (n,)."""
    table = np.asarray(law.from_standard(jnp.asarray(GRID)))
    order = np.argsort(table, kind="stable")
    return np.interp(values, table[order], GRID[order])
