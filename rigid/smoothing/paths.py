"""What a batch of draws says of a test: load, displacement and kappa, by cylinder and in total."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import numpy as np

from rigid.smoothing.field import BLOCK, Field
from rigid.smoothing.laws import Law, draws
from rigid.smoothing.learning import Learned
from rigid.smoothing.model import KAPPA, LATENT_SCALES, LOAD
from rigid.smoothing.smoother import STEPS, smooth

BATCH, SHORT_BATCH, SHORT = 8, 32, 5_000
"""Draws in one compiled program, and in that of records up to SHORT samples: the more the cheaper
is a draw, but all of them are in memory at once."""

FINE_UP_TO = 20_000
"""Samples up to which every step between samples is told; of longer records only the steps of
intervals in which something jumped."""

JUMPED = 300.0 / LATENT_SCALES[0], 0.02 / LATENT_SCALES[2]
"""Sd of a movement of the load [N] or of kappa within an interval that is told in full."""

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
    """The cylinders of one field test, what was learned of each, and the times that are told.

    - `rows` (times,): steps since the first sample.
    """

    fields: tuple[Field, ...]
    learned: tuple[Learned, ...]
    rows: np.ndarray

    @property
    def batch(self) -> int:
        """Draws that are smoothed together."""
        return SHORT_BATCH if self.fields[0].samples <= SHORT else BATCH

    @property
    def time(self) -> np.ndarray:
        """Times that are told [s], on the clock of the file."""
        return self.fields[0].first + self.rows * self.fields[0].interval / STEPS


def told(fields: Sequence[Field], learned: Sequence[Learned]) -> np.ndarray:
    """Steps that are told: all of a short record, else every sample and what lies in jumps."""
    samples = min(f.samples for f in fields)
    last = (samples - 1) * STEPS
    if samples <= FINE_UP_TO:
        return np.arange(last + 1)
    jumped = np.zeros(samples, dtype=bool)
    for one in learned:
        sd = np.sqrt(one.movement.variances[:samples] * STEPS)
        jumped |= (sd[:, LOAD] > JUMPED[0]) | (sd[:, KAPPA] > JUMPED[1])
    fine = np.zeros((samples, STEPS), dtype=bool)
    fine[:, 0] = True
    fine[jumped] = True
    return np.flatnonzero(fine.reshape(-1)[: last + 1])


def quantities(test: Test, law: Law, rng: np.random.Generator) -> Mapping[str, Path]:
    """Smooth a test for a batch of draws, at most `test.batch`; by name, such as `load_A`.

    With two cylinders `load_total` is the sum, `displacement_mean` the plate's middle and `tilt`
    how far the first cylinder's end is ahead of the second's.
    """
    out: dict[str, Path] = {}
    for field, learned in zip(test.fields, test.learned, strict=True):
        seed = int(rng.integers(2**31))
        parts = _cylinder(field, law, learned, (seed, test.batch, test.rows))
        for name, part in zip(("load", "displacement", "kappa"), parts, strict=True):
            out[f"{name}_{field.cylinder}"] = part
    if len(test.fields) == 2:
        a, b = (f.cylinder for f in test.fields)
        out["load_total"] = out[f"load_{a}"].plus(out[f"load_{b}"])
        both = out[f"displacement_{a}"], out[f"displacement_{b}"]
        out["displacement_mean"] = both[0].plus(both[1]).times(0.5)
        out["tilt"] = both[0].plus(both[1], -1.0)
    return out


def _cylinder(
    field: Field, law: Law, learned: Learned, run: tuple[int, int, np.ndarray]
) -> list[Path]:
    """Load, displacement and kappa of one cylinder; `run`: seed, draws together, rows."""
    seed, batch, rows = run
    count = law.size
    padded = law.only(np.minimum(np.arange(batch), count - 1))
    keys = jax.random.split(jax.random.key(seed), batch)
    found = np.zeros((4, count, len(rows), 3))
    for first, block in smooth(field, draws(padded, field), learned.evidence, keys):
        here = (rows >= first * STEPS) & (rows < (first + BLOCK) * STEPS)
        inside = rows[here] - first * STEPS
        assert block.shown is not None  # there are keys
        for i, part in enumerate(block.shown):
            flat = np.asarray(part).reshape(batch, -1, 3)
            found[i][:, here] = flat[:count][:, inside]
    return [Path(*found[..., i]) for i in range(3)]
