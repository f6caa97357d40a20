"""The noise that a fit found in every sensor, beside what its sheet says."""

from typing import Any

import numpy as np

from rigid.io.files import finite
from rigid.localfit.local import LocalFit


def noise_found(local: LocalFit) -> list[dict[str, Any]]:
    """Entries `noise` of a result, a sensor each, SI.

    - `local`: a fit whose samples have been weighed.

    `sd` and `sheet_sd`: of a sample, as found and by the sheet. `sd_least`, `sd_greatest`: where
    noise grows with the reading; `sd` squared then is the harmonic mean of the variances. `counts`:
    how many independent samples one stands for, on average. `degrees_of_freedom`: of Student's law,
    where tails are heavy.
    """
    layout, problem = local.layout, local.layout.problem
    sigma = local.hypothesis.sigmas(local.z_noise)
    sheets = {p.sensor(i): p.sheet for p in problem.pieces for i in range(len(p.tracks))}
    quantities = {channel.sensor: channel.quantity for channel in layout.channels}
    parameters = problem.parameters
    units = {p.label: p.unit for p in (*parameters.sampled, *parameters.known)}
    found = []
    for number, sensor in enumerate(problem.sensors):
        rows = (layout.sensor == number) & layout.read
        read, loud = layout.weight[rows], np.sqrt(layout.loud[rows])
        dof = layout.tails.get(quantities[sensor])
        # with tails the level is the scale of Student's law
        sd = float(sigma[number]) * (1.0 if dof is None else float(np.sqrt(dof / (dof - 2.0))))
        grows = len(loud) > 0 and loud.max() > loud.min()
        found.append(
            {
                "sensor": sensor,
                "unit": units[f"noise[{sensor}]"],
                "sd": finite(sd),
                "sd_least": finite(sd * float(loud.min())) if grows else None,
                "sd_greatest": finite(sd * float(loud.max())) if grows else None,
                "sheet_sd": sheets[sensor].noise,
                "counts": finite(float(read.mean())) if len(read) else None,
                "degrees_of_freedom": dof,
            }
        )
    return found
