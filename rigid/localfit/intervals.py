"""Intervals of parameters by the Gaussian approximation around a fit."""

from typing import Any

import numpy as np

from rigid.localfit.local import LocalFit

Z_90 = 1.6448536269514722


def interval(local: LocalFit, label: str) -> dict[str, Any]:
    """Median and 90 % interval of a parameter, by the Gaussian law around the fit."""
    number = local.hypothesis.labels.index(label)
    parameter = local.hypothesis.parameters[number]
    sd = float(np.sqrt(local.covariance[number, number]))
    quantiles = {"median": 0.0, "q05": -Z_90 * sd, "q95": Z_90 * sd}
    values = {
        k: float(parameter.prior.from_standard(local.w[number] + shift))
        for k, shift in quantiles.items()
    }
    if values["q05"] > values["q95"]:  # laws of negative quantities fall
        values["q05"], values["q95"] = values["q95"], values["q05"]
    return values | {"unit": parameter.unit}
