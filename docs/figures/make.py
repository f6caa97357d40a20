"""Make the README's figure from the posterior of the example calibration.

python -m rigid.fit calibration && python docs/figures/make.py
"""

from pathlib import Path

import numpy as np

from rigid.inference.posterior import load_posterior
from rigid.plots.shown import QUANTILES, FrictionCurve
from rigid.plots.vector import svg
from rigid.report.calibration.figures.friction import friction_figure
from rigid.report.calibration.shown import narrowed
from rigid.report.paper_values import FRICTION


def quantiles(group, name: str) -> np.ndarray:
    """QUANTILES of a variable over all draws, (5, frequencies)."""
    values = group[name].to_numpy()
    return np.percentile(values.reshape(-1, values.shape[-1]), QUANTILES, axis=0)


def magnitude(group) -> np.ndarray:
    """QUANTILES of |mu|, (5, frequencies)."""
    frequency = group["frequency"].to_numpy()
    whole = np.hypot(group["mu_omega"], group["k_omega"] / (2 * np.pi * frequency)).to_numpy()
    return np.percentile(whole.reshape(-1, whole.shape[-1]), QUANTILES, axis=0)


def main() -> None:
    """Write calibration.svg beside this file."""
    tree = load_posterior("reports/calibration/posterior.nc")
    posterior, prior = tree["posterior"], tree["prior"]
    size, before = magnitude(posterior), magnitude(prior)
    curve = FrictionCurve(
        frequency=posterior["frequency"].to_numpy(),
        dissipative=quantiles(posterior, "mu_omega"),
        storage=quantiles(posterior, "k_omega"),
        magnitude=size,
        prior_magnitude=before,
        informed=narrowed(size, before),
        published=tuple((f, p.value, p.place) for f, p in FRICTION),
    )
    figure = friction_figure(curve, simulated=True)
    Path(__file__).with_name("calibration.svg").write_text(svg(figure, "readme"), encoding="utf-8")


if __name__ == "__main__":
    main()
