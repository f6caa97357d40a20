"""What draws of z say: parameters in SI, friction, sensors, predictions beside data."""

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.inference.friction_curve import Friction, friction, in_rows, scopes
from rigid.inference.search import Found
from rigid.io.compiled import compiled
from rigid.likelihood.channels import Piece
from rigid.likelihood.correlation import ahead, noise_law
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.problem import Problem, evaluate, in_batches, predict

LEVELS = (5.0, 25.0, 50.0, 75.0, 95.0)


@dataclasses.dataclass(frozen=True)
class ChannelDraws:
    """One sensor in one record: what it read and what the posterior says it should have read.

    - `record`, `cylinder`, `kind`, `quantity`; `time` (n,) [s]; `data` (n,) SI, NaN where nothing
      was read. - `quantiles` (5, n): LEVELS of the noiseless reading, gain and zero included.
    - `replicates` (draws, n): readings with noise and rounding, as the sensor would give them.
    - `residual` (n,): one step ahead, over `floor`. - `gap`: its root mean square.
    - `correlation_time` [s]: 0 where residuals are independent.
    """

    record: str
    cylinder: str
    kind: str
    quantity: str
    time: np.ndarray
    data: np.ndarray
    quantiles: np.ndarray
    replicates: np.ndarray
    residual: np.ndarray
    gap: float
    correlation_time: float


@compiled
def _values(parameters: Parameters, z: Array) -> dict[str, Array]:
    return parameters.values(z)


def values_of(problem: Problem, z: np.ndarray) -> dict[str, np.ndarray]:
    """Parameters in SI by label, (n,) each, the known ones included, for z (n, size)."""
    parts = [_values(problem.parameters, jnp.asarray(rows)) for rows in in_rows(z)]
    return {k: np.concatenate([np.asarray(p[k]) for p in parts])[: len(z)] for k in parts[0]}


def frictions(problem: Problem, values: dict[str, np.ndarray]) -> dict[str, Friction]:
    """Friction over frequency for every view of the rig that has its own."""
    return {
        label: friction(problem.effects, values, scope) for label, scope in scopes(problem).items()
    }


def evaluations(problem: Problem, z: np.ndarray) -> tuple[dict, dict]:
    """Log-likelihood of every track and law of every sensor, for z (n, size).

    Returns (n,) by track and (5, n) by sensor: gain, zero, variances and covariance.
    """
    parts = in_batches(evaluate, problem, z)
    first = parts[0][0]
    tracks = {
        label: np.concatenate([p.tracks[label][:n] for p, n in parts]) for label in first.tracks
    }
    sensors = {
        label: np.concatenate([p.sensors[label][:, :n] for p, n in parts], axis=1)
        for label in first.sensors
    }
    return tracks, sensors


def sensor_draws(laws: dict[str, np.ndarray], rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Draw gain and zero (2, n) of each sensor from its law given the rest."""
    out = {}
    for label, (gain, zero, var_gain, covariance, var_zero) in laws.items():
        a, b = rng.standard_normal((2, len(gain)))
        # A gain that is exact has no spread, and nothing goes with it.
        slope = np.divide(covariance, var_gain, out=np.zeros_like(gain), where=var_gain > 0.0)
        rest = np.sqrt(np.maximum(var_zero - slope * covariance, 0.0))
        shift = np.sqrt(var_gain) * a
        out[label] = np.stack([gain + shift, zero + slope * shift + rest * b])
    return out


def channels(found: Found, z: np.ndarray, seed: int) -> list[ChannelDraws]:
    """Compare every channel with predictions from draws z (n, size); the first is the best fit.

    Draws of a prior at which a machine flies apart are left out; others take their places.
    """
    problem, rng = found.problem, np.random.default_rng(seed)
    _, laws = evaluations(problem, z)
    drawn = sensor_draws(laws, rng)
    for label, law in laws.items():
        drawn[label][:, 0] = law[:2, 0]
    values = values_of(problem, z)
    parts = in_batches(predict, problem, z)
    rows = _simulated(parts)
    out = []
    for piece in problem.pieces:
        for i, track in enumerate(piece.tracks):
            reading = np.concatenate(
                [p[piece.group][piece.quantity][:, track, :n] for p, n in parts], axis=1
            ).T
            gain, zero = drawn[piece.sensor(i)][:, rows]
            reading = reading[rows] * (1.0 + gain[:, None]) + zero[:, None]
            sigma = values[f"noise[{piece.sensor(i)}]"][rows]
            out.append(_channel(found, piece, i, reading, (sigma, rng)))
    return out


def _simulated(parts: Sequence[tuple[list[dict[str, np.ndarray]], int]]) -> np.ndarray:
    """Numbers (n,) of draws whose readings are all finite, from the first on, again and again.

    - `parts`: readings by group and quantity (samples, tracks, draws) and how many draws count.
    """
    finite = np.concatenate([
        np.all([np.isfinite(s[..., :n]).all(axis=(0, 1)) for g in p for s in g.values()], axis=0)
        for p, n in parts
    ])  # fmt: skip
    good = np.flatnonzero(finite)
    return np.resize(good, len(finite)) if len(good) else np.arange(len(finite))


def _channel(found: Found, piece: Piece, i: int, reading: np.ndarray, noise: tuple) -> ChannelDraws:
    """Make one channel; row 0 of `reading` (draws, samples) is the best fit."""
    track = found.problem.groups[piece.group].tracks[piece.tracks[i]]
    n, step = int(track.samples), piece.sheet.step
    data, read = np.asarray(piece.data)[:n, i], np.asarray(piece.weight)[:n, i] > 0
    reading = reading[:, :n]
    sigma, rng = noise
    replicates = reading + sigma[:, None] * rng.standard_normal(reading.shape)
    if step > 0.0:
        replicates = np.round(replicates / step) * step
    raw = np.where(read, data - reading[0], 0.0) / piece.sheet.floor
    innovations = ahead(noise_law(raw, read), raw, read)
    memory = found.correlation[piece.group, piece.quantity, piece.tracks[i]]
    return ChannelDraws(
        record=track.name,
        cylinder=track.cylinder,
        kind=track.kind,
        quantity=piece.quantity,
        time=track.times,
        data=np.where(read, data, np.nan),
        quantiles=np.percentile(reading, LEVELS, axis=0),
        replicates=replicates.astype(np.float32),
        residual=innovations,
        gap=float(np.sqrt(np.nanmean(innovations**2))),
        correlation_time=memory.time * track.interval if memory.time > 1.0 else 0.0,
    )


def overall_gap(shown: list[ChannelDraws]) -> float:
    """Root mean square of all residuals together."""
    return float(np.sqrt(np.nanmean(np.concatenate([c.residual for c in shown]) ** 2)))
