"""How many facts a sample is, judged once what physics can explain has been taken out.

Residuals that resemble their neighbours count less (`rigid.likelihood.correlation`). But a missing
effect makes neighbours alike, too; taken for correlated noise, it would hide itself. So the
correlation is that of what is left after the signatures of all effects and hidden forces have been
fitted (`leftover.py`). Readings that move fast count less where instants jitter (`instants.py`),
large ones where noise grows with the reading (`growing.py`), and single samples far off where noise
has heavy tails (`tails.py`). Samples that are set aside (`rigid.likelihood.set_aside`) do not count
at all.
"""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.likelihood.set_aside import readings_of, set_aside
from rigid.localfit.local import LocalFit, with_weights
from rigid.localfit.noise.growing import by_growth
from rigid.localfit.noise.instants import louder
from rigid.localfit.noise.leftover import Explaining, Traces, noise_laws
from rigid.localfit.noise.tails import by_tails


class Facts(NamedTuple):
    """How much samples count.

    - `weight` (n,): 0 for those set aside, else one over correlation times, and less where instants
      jitter, tails are heavy or noise is loud. - `loud` (n,): variance of noise that grows with the
      reading, over that of its sensor. - `tails`: degrees of freedom by quantity, where they are
      heavy.
    """

    weight: Float[np.ndarray, " n"]
    loud: Float[np.ndarray, " n"]
    tails: Mapping[str, float]

    def of(self, local: LocalFit) -> LocalFit:
        """Return a fit of the same samples that counts them so."""
        layout = dataclasses.replace(local.layout, tails=self.tails, loud=self.loud)
        return with_weights(dataclasses.replace(local, layout=layout), self.weight)


def facts(local: LocalFit, traces: Traces) -> Facts:
    """Judge how much each sample counts.

    - `local`: fitted with weight 1 wherever something was read. - `traces`: of what may be missing.
    """
    layout = local.layout
    readings = readings_of(layout.problem, local.hypothesis.sigmas(local.z_noise))
    good = layout.read & ~set_aside(readings, local.residual)
    explaining = Explaining.by(local, traces.columns)
    left = explaining.left[:, 0]
    jitter = louder(local, left, good)
    unexplained = (local.residual - explaining.explained) / np.sqrt(jitter)
    scores = left / np.sqrt(jitter)
    loud = by_growth(layout, readings, local.reading, unexplained, scores, good)
    even = unexplained / np.sqrt(loud)
    lighter, found = by_tails(layout, readings, even, good, explaining.leverage)
    weight = np.where(good, lighter, 0.0) / (jitter * loud)
    for number, law in enumerate(noise_laws(local, explaining, traces, good)):
        weight[layout.channel == number] /= law.time
    return Facts(weight, loud, found)
