"""The verdict of a fit and its files: checks, tables, posterior.nc."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from rigid.inference.calibrate import KEPT_STEPS, Calibrated
from rigid.inference.derived import ChannelDraws, frictions, overall_gap, values_of
from rigid.inference.export import (
    about,
    about_sensors,
    dataset,
    diagnostics,
    log_likelihood,
    series_groups,
    with_friction,
)
from rigid.inference.friction_curve import FREQUENCIES, Friction
from rigid.inference.posterior import chain_coords, save_posterior
from rigid.inference.summary import (
    Check,
    Cost,
    Gap,
    ParameterRow,
    Result,
    Summary,
    summarise,
)
from rigid.io.provenance import versions
from rigid.likelihood.problem import Problem
from rigid.likelihood.set_aside import listed
from rigid.plots.metrology import digits_apart
from rigid.report.paper_values import of_the_paper, printed
from rigid.report.taken import taken
from rigid.report.usability import covered, noise, optimum, residuals
from rigid.spec import Spec

REPORTED_HZ = (0.01, 80.0, 100.0)
"""Frequencies at which |mu| stands in the tables: as good as 0, that of a release of this rig, and
that of the 10 ms for which the paper prints eq. (17)."""

LEAST_SHARE_OF_STARTS = 2
"""Starts that must have reached the best optimum, for it not to be a lucky one."""

BAD_TAIL = 0.7
"""Pareto shape beyond which importance weights say nothing (Vehtari et al. 2024)."""

PRIOR_DRAWS = 2000


class At(NamedTuple):
    """A frequency [Hz], and the view of the rig whose friction it is; "" where all have one."""

    view: str
    hertz: float

    @property
    def label(self) -> str:
        """Name in the tables."""
        return f"abs_mu[{self.hertz:g} Hz{',' + self.view if self.view else ''}]"


def friction_at(done: Calibrated, kept: bool = False) -> dict[At, np.ndarray]:
    """|mu| of the draws at REPORTED_HZ, (chain, draw), of every view the slow one first.

    - `kept`: of the fewer draws in posterior.nc.
    """
    curves, shape = done.frictions, done.shape
    if kept:
        curves, shape = done.kept_frictions, done.kept_shape
    return {at: draws.reshape(shape) for at, draws in magnitudes(curves).items()}


def magnitudes(curves: Mapping[str, Friction]) -> dict[At, np.ndarray]:
    """|mu| of the draws at REPORTED_HZ, (draws,), of the curves of every view."""
    places = {hertz: int(np.argmin(np.abs(FREQUENCIES - hertz))) for hertz in REPORTED_HZ}
    return {
        At(view, hertz): curve.magnitude[:, place]
        for view, curve in curves.items()
        for hertz, place in places.items()
    }


def rows(done: Calibrated) -> list[ParameterRow]:
    """Rows of the tables: every sampled parameter, then |mu|."""
    chains = done.shape[0]
    ensemble = np.arange(chains) // (chains // done.ensembles)
    return table_rows(
        done.problem, done.values, friction_at(done), lambda draws: summarise(draws, ensemble)
    )


def table_rows(
    problem: Problem,
    values: Mapping[str, np.ndarray],
    frictions: Mapping[At, np.ndarray],
    summary: Callable[[np.ndarray], Summary],
) -> list[ParameterRow]:
    """Rows of draws, SI by label, and of |mu|; `summary` gives the figures of one of them."""
    ours = of_the_paper(problem)
    return [
        *(
            ParameterRow(p.label, p.unit, summary(values[p.label]), printed(p.base, ours))
            for p in problem.parameters.sampled
        ),
        *(ParameterRow(at.label, "N s/m", summary(draws)) for at, draws in frictions.items()),
    ]


def checks(done: Calibrated) -> list[Check]:
    """What must hold for the result to be used."""
    best = done.found.optima[0]
    listed = [Check("converged", bool(done.draws.converged), done.draws.says)]
    listed.append(covered(done.known, done.draws.weighed))
    starts = f"{best.reached} of {done.found.starts} starts ended in the best optimum"
    enough = best.reached >= min(LEAST_SHARE_OF_STARTS, done.found.starts)
    listed += [Check("starts", enough, starts), optimum(done.found.settled)]
    listed += [residuals_check(done.shown), noise(done.found)]
    if done.solver is not None:
        listed.append(done.solver.check)
    if len(done.found.optima) > 1:
        k = done.weights.pareto_k
        listed.append(
            Check("mode weights", bool(k < BAD_TAIL), f"Pareto shape of their weights is {k:.2f}")
        )
    return listed


def residuals_check(shown: list[ChannelDraws]) -> Check:
    """Whether what the model leaves of every channel is what its sensor's sheet says."""
    channels = {f"{c.quantity} of {c.record},{c.cylinder}": c.gap for c in shown}
    return residuals(overall_gap(shown), channels)


def gaps(done: Calibrated) -> Gap:
    """Gap by record and channel; two cylinders of a record are told apart by the cylinder."""
    records: dict[str, dict[str, float | None]] = {}
    twice = {
        c.record
        for c in done.shown
        for d in done.shown
        if c.record == d.record and c.cylinder != d.cylinder
    }
    for c in done.shown:
        name = f"{c.record},{c.cylinder}" if c.record in twice else c.record
        records.setdefault(name, {})[c.quantity] = c.gap
    return Gap(overall_gap(done.shown), records)


def result(spec: Spec, done: Calibrated, wall: float) -> Result:
    """Gather result.json."""
    gap = gaps(done)
    table = rows(done)
    sizes = [r.summary.ess_bulk for r in table if r.summary.ess_bulk is not None]
    cost = Cost(
        wall_s=wall,
        compile_s=done.compile_s,
        evaluations=int(done.draws.evaluations),
        ess_min=min(sizes) if sizes else None,
        failed_solves=int(done.draws.failed),
    )
    return Result(
        spec=spec.path.stem,
        simulated=spec.simulated,
        checks=checks(done),
        parameters=table,
        gap=gap,
        cost=cost,
        seed=done.seed,
        versions=versions(),
        sha256={f"{r.name},{r.cylinder}": r.sha256 for r in done.records},
        solver=None if done.solver is None else done.solver.values(),
        taken=taken(spec, done.problem, listed(done.problem, done.found.aside)),
    )


def groups(done: Calibrated, table: Sequence[ParameterRow]) -> dict[str, xr.Dataset]:
    """Gather the groups of posterior.nc by name.

    - `table`: rows of the tables; what they say of convergence goes into the file.
    """
    problem, shape = done.problem, done.kept_shape
    described = about(problem.parameters)
    coords = chain_coords(done.ensembles, shape[0] // done.ensembles, shape[1])
    sampled = {p.label: done.kept[p.label] for p in problem.parameters.sampled}
    about_pairs = about_sensors(problem)
    for sensor, pair in done.sensors.items():
        described |= about_pairs[sensor]
        for label, series in zip(about_pairs[sensor], pair, strict=True):
            sampled[label] = series.reshape(shape)
    posterior = with_friction(dataset(sampled, described, coords), done.kept_frictions, shape)
    kept = done.draws.thinned(KEPT_STEPS).log_prob
    density = np.swapaxes(kept, 1, 2).reshape(shape)
    known = {
        p.label: float(p.prior.from_standard(np.zeros(1))[0]) for p in problem.parameters.known
    }
    return {
        "posterior": posterior,
        "prior": _prior(done),
        "log_likelihood": log_likelihood(problem, done.tracks, done.blocks, shape).assign_coords(
            coords
        ),
        "sample_stats": xr.Dataset(
            {"lp": (("chain", "draw"), density, {"units": "1"}), **diagnostics(table)},
            coords=coords | {"parameter": [row.name for row in table]},
        ),
        "constant_data": xr.Dataset(
            {k: ((), v, {"units": described[k].unit}) for k, v in known.items()}
        ),
        **series_groups(done.shown, "posterior_predictive"),
        "prior_predictive": series_groups(done.prior_shown, "p")["p"],
    }


def _prior(done: Calibrated) -> xr.Dataset:
    """Draws of the prior."""
    problem = done.problem
    z = np.random.default_rng([done.seed, 3]).standard_normal(
        (PRIOR_DRAWS, problem.parameters.size)
    )
    drawn = values_of(problem, z)
    values = {p.label: drawn[p.label][None] for p in problem.parameters.sampled}
    coords = {"chain": [0], "draw": np.arange(PRIOR_DRAWS)}
    body = dataset(values, about(problem.parameters), coords)
    return with_friction(body, frictions(problem, drawn), (1, PRIOR_DRAWS))


def write_posterior(
    path: Path,
    spec: Spec,
    done: Calibrated,
    found: Result,
    groups: Mapping[str, xr.Dataset],
    spec_folder: str | None = None,
) -> None:
    """Write posterior.nc.

    - `groups`: those of the calibration, from `groups`. - `spec_folder`: the spec's, where it is
      not to be worked out from the two paths.
    """
    beside = _beside(spec, path) if spec_folder is None else spec_folder
    save_posterior(path, groups, provenance(spec, done, found) | {"spec_folder": beside})


def provenance(spec: Spec, done: Calibrated, found: Result) -> dict[str, str | int]:
    """Attributes that tell where a posterior came from, and whether it may be used."""
    return {
        "spec": spec.text,
        "spec_name": spec.path.stem,
        "simulated": int(spec.simulated),
        "usable": int(found.usable),
        "failed_checks": "; ".join(f"{c.name}: {c.says}" for c in found.checks if not c.ok),
        "effects": ",".join(spec.model.effects),
        "seed": done.seed,
        "versions": json.dumps(versions()),
        "sha256": json.dumps({f"{r.name},{r.cylinder}": r.sha256 for r in done.records}),
    }


def _beside(spec: Spec, path: Path) -> str:
    """Where the spec lies, seen from the posterior's folder: effects of one's own stand there."""
    there = spec.path.parent.resolve()
    try:
        return Path(os.path.relpath(there, path.parent.resolve())).as_posix()
    except ValueError:  # on another drive, which has no way from here
        return there.as_posix()


def table(found: Result) -> str:
    """The parameters as a table for the terminal, with the gap and the verdict."""
    wide = max([30, *(len(row.name) for row in found.parameters)]) + 2
    head = f"{'unit':8}{'median':>12}{'5 %':>12}{'95 %':>12}{'ESS':>8}{'R-hat':>8}"
    lines = [f"{'parameter':{wide}}{head}"]
    for row in found.parameters:
        s = row.summary
        ess = f"{s.ess_bulk:8.0f}" if s.ess_bulk is not None else f"{'-':>8}"
        r_hat = f"{s.r_hat:8.3f}" if s.r_hat is not None else f"{'-':>8}"
        d = digits_apart(s.q05, s.q95)
        figures = f"{s.median:12.{d}g}{s.q05:12.{d}g}{s.q95:12.{d}g}"
        lines.append(f"{row.name:{wide}}{row.unit:8}{figures}{ess}{r_hat}")
    note = "simulated data; " if found.simulated else ""
    verdict = "is usable" if found.usable else "must not be used as it stands"
    lines.append(f"{note}gap {found.gap.overall:.3f} (1 is the floor); the result {verdict}")
    return "\n".join(lines) + "\n"
