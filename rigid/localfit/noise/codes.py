"""What the converters of the sensors make of noise: scores of the codes that it leads to.

Where a converter's step is wide against the noise, a reading tells much where its true value is
about to turn over to the next step and hardly anything elsewhere, and noise that lasts looks
quicker than it is. So noise is put on the fit's expected readings, rounded as the records are, and
scored by the likelihood that they have.
"""

import dataclasses

import jax.numpy as jnp
import numpy as np

from rigid.localfit.local import LocalFit, levels_of, peak
from rigid.localfit.samples import terms

LOUDER, LEVELS = 0.3, 25
"""Prior sd of the logarithm of a record's noise over that of its sensor; how many are tried."""
FAR = 12.0
"""Noise, in its own sds, up to which codes are scored; beyond, the farthest one stands in."""


@dataclasses.dataclass(frozen=True)
class Codes:
    """Scores of all codes around those on record.

    - `rows`: numbers of each channel's samples. - `sigma` (n,): noise of each. - `step`
      (channels,): of its converter; 0 where it is so fine that noise counts as it is.
    - `residual`, `curvature` (n,): of the records. - `score` (n, 2 reach + 1): of each sample, were
      it so many codes higher.
    - `unit` (channels,): what scores are multiplied by for a variance of 1 where all noise is told.
    """

    rows: tuple[np.ndarray, ...]
    sigma: np.ndarray
    step: np.ndarray
    residual: np.ndarray
    curvature: np.ndarray
    score: np.ndarray
    unit: np.ndarray

    @classmethod
    def of(cls, local: LocalFit) -> "Codes":
        """Score the codes around the readings that a fit expects."""
        layout, levels = local.layout, local.hypothesis.sigmas(local.z_noise)
        sheets = [p.sheet for p in layout.problem.pieces for _ in p.tracks]
        rows = tuple(np.flatnonzero(layout.channel == i) for i in range(len(sheets)))
        noise = np.array([levels[layout.sensor[mine[0]]] for mine in rows])
        step = np.array([s.step if s.nodes else 0.0 for s in sheets])
        fine = np.array([0.0 if s.nodes else s.step for s in sheets])
        usual = np.hypot(noise, fine / 12.0**0.5)
        sigma, coarse = usual * _louder(local, rows, noise), step > 0.0
        each, wide = sigma[layout.channel] * np.sqrt(layout.loud), step[layout.channel]
        rounded = coarse[layout.channel]
        reach = int(np.ceil(FAR * np.max(each[rounded] / wide[rounded], initial=0.0)))
        score = [
            terms(layout, local.residual + k * wide, levels).score for k in range(-reach, reach + 1)
        ]
        counted = [layout.weight[mine].sum() / max(layout.read[mine].sum(), 1) for mine in rows]
        curvature = np.maximum(local.terms.curvature, 0.0)
        unit = usual**2 / (sigma * np.where(counted, counted, 1.0))
        return cls(rows, each, step, local.residual, curvature, np.stack(score, axis=1), unit)

    def of_noise(self, number: int, noise: np.ndarray) -> np.ndarray:
        """Scores (m, draws) of a channel's samples, were their noise so many sds (m, draws)."""
        rows, step = self.rows[number], self.step[number]
        off = self.sigma[rows, None] * noise
        if not step:
            return self.curvature[rows, None] * off
        reach = self.score.shape[1] // 2
        higher = np.rint((off - self.residual[rows, None]) / step)
        code = np.clip(higher, -reach, reach).astype(int) + reach
        return np.take_along_axis(self.score[rows], code, axis=1)


def _louder(local: LocalFit, rows: tuple[np.ndarray, ...], sigma: np.ndarray) -> np.ndarray:
    """Most probable noise of each channel over that of its sensor (channels,)."""
    layout = local.layout
    sheets = [p.sheet for p in layout.problem.pieces for _ in p.tracks]
    z = np.linspace(-3.0, 3.0, LEVELS)
    tried = np.exp(LOUDER * z)
    found = []
    for sheet, mine, usual in zip(sheets, rows, sigma, strict=True):
        residual, weight = jnp.asarray(local.residual[mine]), jnp.asarray(layout.weight[mine])
        height = np.asarray(levels_of(sheet, residual, weight, jnp.asarray(usual * tried)))
        found.append(np.exp(LOUDER * peak(z, height - 0.5 * z**2)))
    return np.array(found)
