"""The first answer of a fit: a Gaussian around the best fit, while draws make it exact."""

import time

import numpy as np

from rigid.inference.derived import channels, frictions, values_of
from rigid.inference.search import Found
from rigid.inference.summary import Check, Cost, Gap, ParameterRow, Result, Summary
from rigid.io.provenance import versions
from rigid.report.calibration.output import magnitudes, residuals_check, table_rows
from rigid.report.usability import noise, optimum
from rigid.spec import Spec

DRAWS = 2000
"""Quantiles of so many are within 0.04 sds of those of the Gaussian."""

SAYS = "preliminary: a Gaussian around the best fit; nothing is drawn yet"

MOVED = 0.1
"""Posterior sds by which no number may have moved for an answer to stand."""

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


def stands(told: Found, found: Found) -> bool:
    """Whether the first answer is still that of the whole search."""
    was, now = told.optima[0], found.optima[0]
    sds = np.sqrt(np.diag(now.covariance))
    return len(found.optima) == 1 and bool(np.all(np.abs(now.z - was.z) < MOVED * sds))


def doubt(spec: Spec, found: Found, seed: int) -> str | None:
    """What to do where the best fit speaks against the model; None where it does not."""
    shown = channels(found, found.optima[0].z[None], seed)
    seen = residuals_check(shown), noise(found), optimum(found.settled)
    bad = [one for one in seen if not one.ok]
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
    found_at = magnitudes(frictions(problem, values))
    return table_rows(problem, values, found_at, Summary.of_independent)


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
