"""The first answer of a fit: a Gaussian around the best fit, while the chain makes it exact."""

import time
from pathlib import Path

import numpy as np

from rigid.inference.derived import channels, frictions, values_of
from rigid.inference.friction_curve import FREQUENCIES
from rigid.inference.search import Found
from rigid.inference.summary import (
    Check,
    Cost,
    Gap,
    ParameterRow,
    Result,
    Summary,
    write_result_json,
)
from rigid.io.provenance import versions
from rigid.report.calibration.output import REPORTED_HZ, residuals_check
from rigid.report.paper_values import of_the_paper, published
from rigid.report.usability import optimum
from rigid.spec import Spec

DRAWS = 2000
"""Quantiles of so many are within 0.04 sds of those of the Gaussian."""

SAYS = "preliminary: a Gaussian around the best fit; the chain has not run yet"

LOCAL = ("noise", "preload", "release_time")
"""What nobody waits for."""


def preliminary(spec: Spec, found: Found, seed: int, began: float) -> Result:
    """Return result.json as it stands after the search; it is not usable.

    - `began`: when the run did, by the monotonic clock [s].
    """
    cost = Cost(time.monotonic() - began, 0.0, 0, None, 0)
    return Result(
        spec=spec.path.stem,
        simulated=spec.simulated,
        checks=[Check("converged", False, SAYS)],
        parameters=rows(found, seed),
        gap=Gap(None, {}),
        cost=cost,
        seed=seed,
        versions=versions(),
        preliminary=True,
    )


def doubt(spec: Spec, found: Found, seed: int) -> str | None:
    """What to do where the best fit speaks against the model; None where it does not."""
    shown = channels(found, found.optima[0].z[None], seed)
    bad = [one for one in (residuals_check(shown), optimum(found.settled)) if not one.ok]
    if not bad:
        return None
    why = "; ".join(f"{one.name}: {one.says}" for one in bad)
    return (
        f"{why}. The chain will not change that: stop (Ctrl-C) and run "
        f"`rigid discover {spec.path.name}`, which looks for what the model lacks; or let it run"
    )


def rows(found: Found, seed: int) -> list[ParameterRow]:
    """Rows of the tables from the Gaussian around the best optimum."""
    problem, best = found.problem, found.optima[0]
    rng = np.random.default_rng([seed, 8])
    z = rng.multivariate_normal(best.z, best.covariance, DRAWS, method="eigh")
    values = values_of(problem, z)
    ours, out = of_the_paper(problem), []
    for p in problem.parameters.sampled:
        printed = published(p.base, ours)
        value = printed[0].value if printed else None
        out.append(ParameterRow(p.label, p.unit, _figures(values[p.label]), value))
    for view, curve in frictions(problem, values).items():
        for frequency in REPORTED_HZ:
            at = int(np.argmin(np.abs(FREQUENCIES - frequency)))
            label = f"abs_mu[{frequency:g} Hz{',' + view if view else ''}]"
            out.append(ParameterRow(label, "N s/m", _figures(curve.magnitude[:, at])))
    return out


def _figures(values: np.ndarray) -> Summary:
    """Figures of independent draws (n,)."""
    q05, median, q95 = (float(q) for q in np.quantile(values, (0.05, 0.5, 0.95)))
    mean, sd = float(np.mean(values)), float(np.std(values, ddof=1))
    return Summary(mean, sd, median, q05, q95, None, None, None)


def table(found: Result) -> str:
    """Lines for the terminal; numbers that no one waits for are left out."""
    lines = [f"first answer after {found.cost.wall_s:.0f} s ({SAYS}):"]
    shown = [row for row in found.parameters if not row.name.startswith(LOCAL)]
    wide = max(len(row.name) for row in shown)
    for row in shown:
        s = row.summary
        figures = f"{s.median:12.5g}  {s.q05:.5g} to {s.q95:.5g}"
        lines.append(f"  {row.name:{wide}}{figures} {row.unit}")
    return "\n".join(lines)


def write(folder: Path, found: Result) -> None:
    """Write result.json; the finished fit takes its place."""
    write_result_json(folder / "result.json", found)
