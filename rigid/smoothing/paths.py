"""What a batch of draws says of a test: load, displacement and kappa, by place and in total."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import jax
import numpy as np
from jax import Array

from rigid.smoothing.field import BLOCK, Field
from rigid.smoothing.inputs import Inputs
from rigid.smoothing.jumps import Jumps, jumps
from rigid.smoothing.kalman import Backward, Smoothed
from rigid.smoothing.laws import RigModel, draws
from rigid.smoothing.learning import Learned
from rigid.smoothing.smoother import STEPS, Back, Evidence, Keeping

BATCH, SMALL_BATCH = 32, 8
"""Draws in one compiled program, and where there are no more than twice as many as in the small
one: the more the cheaper is a draw, but what a stretch is found to be is in memory for all."""

STRETCH = 8
"""Blocks, 41 s at 100 Hz, that all draws go through before the next ones are looked at."""

FINE_UP_TO = 20_000
"""Samples up to which every step between samples is told; of longer records only the steps of
intervals in which something jumped."""

JUMPED_LOAD, JUMPED_FLOW = 0.3, 0.2
"""Sd of a movement of a load or of a flow fraction within an interval that is told in full, in
units of sizes: on the rig 300 N and 0.02."""

UNITS = {"load": "N", "displacement": "m", "kappa": "1", "tilt": "m"}


class Path(NamedTuple):
    """One quantity for a batch of draws, (draws, times) each, SI.

    - `mean`, `variance`: smoothed. - `own`, `noise`: one draw of the errors that the load's own
      movement and the sensors' noise leave.
    """

    mean: np.ndarray
    variance: np.ndarray
    own: np.ndarray
    noise: np.ndarray

    def plus(self, other: "Path", factor: float = 1.0) -> "Path":
        """Return the sum with `factor` times an independent path."""
        return Path(
            self.mean + factor * other.mean,
            self.variance + factor**2 * other.variance,
            self.own + factor * other.own,
            self.noise + factor * other.noise,
        )

    def times(self, factor: float) -> "Path":
        """Return the path times a number."""
        return Path(
            factor * self.mean, factor**2 * self.variance, factor * self.own, factor * self.noise
        )


class Test(NamedTuple):
    """The records of one test, what was learned of each, and the times that are told.

    - `rows` (times,): steps since the first sample. - `evidence`: of each, for the smoother.
    """

    fields: tuple[Field, ...]
    learned: tuple[Learned, ...]
    rows: np.ndarray
    evidence: tuple[Evidence, ...]

    @property
    def time(self) -> np.ndarray:
        """Times that are told [s], on the clock of the file."""
        return self.fields[0].first + self.rows * self.fields[0].interval / STEPS

    @property
    def middle(self) -> dict[str, np.ndarray]:
        """Load [N] at the posterior's centre at the told times, by place, and in total."""
        loads = {
            place: one.mean[..., at].reshape(-1)[self.rows]
            for field, one in zip(self.fields, self.learned, strict=True)
            for at, place in enumerate(field.setup.inputs.loads)
        }
        return {"total": np.sum(list(loads.values()), axis=0)} | loads


def told(fields: Sequence[Field], learned: Sequence[Learned]) -> np.ndarray:
    """Steps that are told: all of a short record, else every sample and what lies in jumps."""
    samples = min(f.samples for f in fields)
    last = (samples - 1) * STEPS
    if samples <= FINE_UP_TO:
        return np.arange(last + 1)
    jumped = np.zeros(samples, dtype=bool)
    for field, one in zip(fields, learned, strict=True):
        sd = np.sqrt(one.movement.variances[:samples] * STEPS)
        jumped |= (sd > _least_jumps(field.setup.inputs)).any(axis=1)
    fine = np.zeros((samples, STEPS), dtype=bool)
    fine[:, 0] = True
    fine[jumped] = True
    return np.flatnonzero(fine.reshape(-1)[: last + 1])


def moved_at(test: Test) -> dict[str, Jumps]:
    """Where the load of each place jumped between two samples, and where any did ("total")."""
    out, every = {}, np.zeros(min(f.samples for f in test.fields), dtype=bool)
    for field, one in zip(test.fields, test.learned, strict=True):
        sd = np.sqrt(one.movement.variances * STEPS)
        for at, place in enumerate(field.setup.inputs.loads):
            jumped = sd[: len(every), at] > JUMPED_LOAD
            out[place] = jumps(test.rows, jumped, STEPS)
            every |= jumped
    return {"total": jumps(test.rows, every, STEPS)} | out


def _least_jumps(inputs: Inputs) -> np.ndarray:
    """Sd from which a movement of each input is a jump; slopes and what was recorded have none."""
    least = np.full(inputs.count, np.inf)
    least[: len(inputs.loads)] = JUMPED_LOAD
    least[inputs.flow_places] = JUMPED_FLOW
    return least


def batch_of(law: RigModel) -> int:
    """How many draws of a law are smoothed together."""
    return SMALL_BATCH if law.size <= 2 * SMALL_BATCH else BATCH


def stretches(test: Test) -> Iterator[slice]:
    """Give the stretches of a test, from the last to the first, as places among its rows."""
    count = test.fields[0].blocks
    for first in range(0, count, STRETCH)[::-1]:
        ends = np.array([first, min(first + STRETCH, count)]) * BLOCK * STEPS
        low, high = np.searchsorted(test.rows, ends)
        yield slice(int(low), int(high))


def left_after(test: Test, stretches: int) -> int:
    """How many blocks of a test are left after so many of its stretches."""
    count = test.fields[0].blocks
    return min(count, STRETCH * (-(-count // STRETCH) - stretches))


class Going:
    """A batch of draws on its way back over a test, stretch by stretch; see `smoother.Back`.

    - `test`; `law`: with the draws of the batch. - `seeds`: of each record, that of its simulated
      errors. - `wide`: draws smoothed together, no fewer than the law has.
    - `begun`: blocks to go, and what those behind them say of each record; None: all of them.
    """

    def __init__(
        self,
        test: Test,
        law: RigModel,
        seeds: Sequence[int],
        wide: int,
        keeping: Keeping,
        begun: tuple[int, Sequence[Backward]] | None = None,
    ):
        self._test, self._count, self._wide = test, law.size, wide
        self._left, behind = begun or (test.fields[0].blocks, [None] * len(test.fields))
        padded = law.only(np.minimum(np.arange(wide), law.size - 1))
        self._back = [
            Back(f, draws(padded, f), evidence, _keys(seed, wide), keeping, self._left, later)
            for f, evidence, seed, later in zip(
                test.fields, test.evidence, seeds, behind, strict=True
            )
        ]

    @property
    def later(self) -> tuple[Backward, ...]:
        """What all samples say that it has gone over, by record."""
        return tuple(back.later for back in self._back)

    def stretch(self) -> Mapping[str, Path]:
        """Smooth the next stretch towards the beginning; gives its told rows by name.

        Names are such as `load_A`. With two cylinders `load_total` is the sum, `displacement_mean`
        the plate's middle and `tilt` how far the first cylinder's end is ahead of the second's.
        """
        last, self._left = self._left, STRETCH * ((self._left - 1) // STRETCH)
        out: dict[str, Path] = {}
        for field, back in zip(self._test.fields, self._back, strict=True):
            found = [self._told(back.block(n), n) for n in range(self._left, last)[::-1]]
            whole = np.concatenate(found[::-1], axis=2)
            for i, name in enumerate(field.setup.inputs.told):
                out[name] = Path(*whole[..., i])
        if len(self._test.fields) == 2:
            a, b = (f.place for f in self._test.fields)
            out["load_total"] = out[f"load_{a}"].plus(out[f"load_{b}"])
            both = out[f"displacement_{a}"], out[f"displacement_{b}"]
            out["displacement_mean"] = both[0].plus(both[1]).times(0.5)
            out["tilt"] = both[0].plus(both[1], -1.0)
        return out

    def _told(self, block: Smoothed, number: int) -> np.ndarray:
        """What is shown of a block at its told rows, (4, draws, rows, told)."""
        assert block.shown is not None  # there are keys
        ends = np.array([number, number + 1]) * BLOCK * STEPS
        low, high = np.searchsorted(self._test.rows, ends)
        inside = self._test.rows[low:high] - ends[0]
        wide = block.shown.mean.shape[-1]
        flat = (np.asarray(part).reshape(self._wide, -1, wide) for part in block.shown)
        return np.stack([part[: self._count, inside] for part in flat])


def _keys(seed: int, wide: int) -> Array:
    return jax.random.split(jax.random.key(seed), wide)
