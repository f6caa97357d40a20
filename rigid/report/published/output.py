"""The files of a fit to published numbers, and the table on standard output."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rigid.inference.posterior import save_posterior
from rigid.inference.summary import COLUMNS, Check, ParameterRow, Summary
from rigid.io.files import csv_text, json_text, write_text
from rigid.io.provenance import versions
from rigid.published.catalogue import CAUSES, STORIES
from rigid.published.run import DRAWS, Findings, Told
from rigid.published.story import PRIOR_SETS
from rigid.report.paper_values import printed
from rigid.spec import Spec

REFERENCE = "constant"
"""The story against which Bayes factors are stated: the paper's own model."""


def figures(told: Told, label: str, values: np.ndarray) -> dict[str, Any]:
    """Figures of one number of one story; the ESS is that of its weighted points."""
    summary = replace(Summary.of_independent(values), ess_bulk=told.all_six.effective)
    row = ParameterRow(label, told.units[label], summary, printed(label))
    return {key: value for key, value in row.values().items() if key != "name"}


def parameters(found: Findings) -> dict[str, dict[str, Any]]:
    """Figures by name, `k_LC[catalogue,root]`: the prior, then the story."""
    return {
        f"{label}[{prior},{key}]": figures(told, label, values)
        for (prior, key), told in found.told.items()
        for label, values in told.draws.items()
    }


def factors(found: Findings, prior: str) -> dict[str, tuple[float, float]]:
    """Log Bayes factor of each story against the reference, with its Monte Carlo error."""
    base = found.told[prior, REFERENCE].all_six
    out = {}
    for told in found.of(prior):
        same = told.story.key == REFERENCE
        error = 0.0 if same else float(np.hypot(told.all_six.error, base.error))
        out[told.story.key] = (told.all_six.log - base.log, error)
    return out


def checks(found: Findings) -> list[Check]:
    """What must hold for the result to be used."""
    worst = min(found.told.values(), key=lambda t: t.all_six.effective)
    says = (
        f"{found.least_effective:.0f} points count in the evidence of '{worst.story.key}' under "
        f"the {worst.prior} prior, the fewest of all (at least 100)"
    )
    return [Check("evidence", found.usable, says)]


def as_dict(spec: Spec, found: Findings, wall: float) -> dict[str, Any]:
    """All of result.json: the keys of a calibration, and `stories`."""
    return {
        "schema": 1,
        "spec": spec.path.stem,
        "usable": found.usable,
        "simulated": False,
        "checks": [one.values() for one in checks(found)],
        "parameters": parameters(found),
        "stories": {prior: _stories(found, prior) for prior in PRIOR_SETS},
        "gap": {"overall": None, "records": {}},
        "cost": {"wall_s": wall, "ess_min": found.least_effective, "failed_solves": 0},
        "seed": found.seed,
        "versions": versions(),
        "sha256": {},
    }


def _stories(found: Findings, prior: str) -> dict[str, Any]:
    """Evidence of each story under one prior."""
    against = factors(found, prior)
    return {
        t.story.key: {
            "title": t.story.title,
            "assumes": t.story.assumes,
            "decides": t.story.decides,
            "log_evidence": t.all_six._asdict(),
            "log_bayes_factor": {"against": REFERENCE, "value": against[t.story.key][0],
                                 "error": against[t.story.key][1]},
            "log_evidence_release": t.release._asdict(),
            "log_evidence_by_cause": {k: e._asdict() for k, e in t.pairs.items()},
            "log_evidence_by_reading": {k: e._asdict() for k, e in t.readings.items()},
            "causes": t.causes,
            "branches": t.branches,
            "oil_above_vacuum": t.held,
        }
        for t in found.of(prior)
    }  # fmt: skip


def write(folder: Path, spec: Spec, found: Findings, made: dict[str, Any]) -> None:
    """Write posterior.nc, summary.csv and, as `made`, result.json."""
    save_posterior(folder / "posterior.nc", groups(found), {
        "spec": spec.text, "spec_name": spec.path.stem, "simulated": 0, "seed": found.seed,
        "versions": json.dumps(versions()),
    })  # fmt: skip
    rows = ((n, *(row[c] for c in COLUMNS[1:])) for n, row in made["parameters"].items())
    write_text(folder / "summary.csv", csv_text(COLUMNS, rows))
    write_text(folder / "result.json", json_text(made))


def groups(found: Findings) -> dict[str, xr.Dataset]:
    """Group `posterior`: (chain, draw, prior, story); NaN where a story has no such number."""
    keys = [s.key for s in STORIES]
    labels = list(dict.fromkeys(label for t in found.told.values() for label in t.draws))
    dims, shape = ("chain", "draw", "prior", "story"), (1, DRAWS, len(PRIOR_SETS), len(keys))
    variables = {}
    for label in labels:
        block, unit = np.full(shape, np.nan), "1"
        for (prior, key), told in found.told.items():
            if label in told.draws:
                at = (PRIOR_SETS.index(prior), keys.index(key))
                block[0, :, at[0], at[1]] = told.draws[label]
                unit = told.units[label]
        variables[label] = (dims, block, {"units": unit})
    cause = np.zeros(shape, dtype=int)
    common = np.full(shape, np.nan)
    for (prior, key), told in found.told.items():
        at = (PRIOR_SETS.index(prior), keys.index(key))
        cause[0, :, at[0], at[1]], common[0, :, at[0], at[1]] = told.cause, told.common
    names = ", ".join(f"{i} {c.key}" for i, c in enumerate(CAUSES))
    variables["cause"] = (dims, cause, {"units": "1", "long_name": names})
    units = "; ".join(f"{c.key}: {c.unit or 'none'}" for c in CAUSES)
    variables["common"] = (dims, common, {"units": "SI, by cause", "long_name": units})
    logs = np.array([[found.told[p, k].all_six[:2] for k in keys] for p in PRIOR_SETS])
    evidence = xr.Dataset(
        {
            "log_evidence": (("prior", "story"), logs[..., 0], {"units": "1"}),
            "log_evidence_error": (("prior", "story"), logs[..., 1], {"units": "1"}),
        },
        coords={"prior": list(PRIOR_SETS), "story": keys},
    )
    coords = {"chain": [0], "draw": np.arange(DRAWS), "prior": list(PRIOR_SETS), "story": keys}
    return {"posterior": xr.Dataset(variables, coords=coords), "evidence": evidence}


def table(found: Findings) -> str:
    """Text for standard output: each story under both priors, then the causes of free running."""
    lines = []
    for prior in PRIOR_SETS:
        lines.append(
            f"{prior + ' prior':34}{'ln B':>8}{'+-':>6}{'T [ms]':>9}{'tau [ms]':>10}"
            f"{'p least [bar]':>15}{'above vacuum':>14}"
        )
        for told in found.of(prior):
            value, error = factors(found, prior)[told.story.key]
            period, fall, least = (
                np.median(told.draws[k]) * f
                for k, f in (("period", 1e3), ("e_folding", 1e3), ("p_least", 1e-5))
            )
            lines.append(
                f"{told.story.title:34}{value:8.2f}{error:6.2f}{period:9.2f}{fall:10.1f}"
                f"{least:15.1f}{told.held:14.3f}"
            )
    lines.append("ln B: log Bayes factor against one constant μ; +-: its Monte Carlo error")
    for prior in PRIOR_SETS:
        lines.append(f"{prior + ' prior, causes':50}{'ln of both S p / v':>8}")
        told = found.told[prior, REFERENCE]
        for cause in CAUSES:
            one = told.pairs[cause.key]
            lines.append(f"{cause.title:50}{one.log - told.release.log:8.2f}{one.error:6.2f}")
    return "\n".join(lines) + "\n"
