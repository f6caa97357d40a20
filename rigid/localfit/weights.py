"""How many facts a sample is, judged once what physics can explain has been taken out.

Residuals that resemble their neighbours count less (`rigid.likelihood.correlation`). But a missing
effect makes neighbours alike, too; taken for correlated noise, it would hide itself. So the
correlation is that of what is left after the signatures of all effects and hidden forces have been
fitted (`rigid.localfit.leftover`). Readings that move fast count less where instants jitter
(`rigid.localfit.instants`), and single samples far off where noise has heavy tails
(`rigid.localfit.tails`). Samples that are set aside (`rigid.likelihood.set_aside`) do not count
at all.
"""

import numpy as np

from rigid.likelihood.set_aside import readings_of, set_aside
from rigid.localfit.instants import louder
from rigid.localfit.leftover import Explaining, Traces, noise_laws
from rigid.localfit.local import LocalFit
from rigid.localfit.tails import lighter


def facts(local: LocalFit, traces: Traces) -> np.ndarray:
    """Weight of each sample (n,): 0 for those set aside, else one over correlation times.

    - `local`: fitted with weight 1 wherever something was read. - `traces`: of what may be missing.
    """
    layout = local.layout
    readings = readings_of(layout.problem, local.hypothesis.sigmas(local.z_noise))
    good = layout.read & ~set_aside(readings, local.residual)
    explaining = Explaining.by(local, traces.columns)
    loud = louder(local, explaining.left[:, 0], good)
    unexplained = (local.residual - explaining.explained) / np.sqrt(loud)
    weight = np.where(good, lighter(layout, readings, unexplained, good), 0.0) / loud
    for number, noise in enumerate(noise_laws(local, explaining, traces, good)):
        weight[layout.channel == number] /= noise.law.time
    return weight
