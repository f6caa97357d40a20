"""batch.json: the fits of a season, and which quantities change from one to the next."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigid.inference.drift import Drift, drift
from rigid.io.files import finite
from rigid.io.provenance import versions

SCHEMA = 1
USABLE, UNUSABLE, FAILED, NOT_FITTED = "usable", "unusable", "failed", "not fitted"
FIGURES = ("unit", "median", "mean", "sd", "q05", "q95")


def as_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """What batch.json says of a campaign, from the row of its job."""
    if row["failed"] is not None:
        return failed(**row["failed"]) | {"cost": row["cost"]}
    found = row["value"]
    parameters = {k: {f: v[f] for f in FIGURES} for k, v in found["parameters"].items()}
    return {
        "status": USABLE if found["usable"] else UNUSABLE,
        "why": found["why"],
        "cost": row["cost"],
        "report": f"{row['job']}/index.html",
        **{key: found[key] for key in ("title", "simulated", "gap", "settings", "seed")},
        "parameters": parameters,
    }


def failed(status: int, says: str) -> dict[str, Any]:
    """Return the entry of a campaign that could not be fitted.

    - `status`: the exit status that its fit alone would have had.
    """
    return {"status": FAILED, "exit_status": status, "why": [says]}


def as_dict(folder: Path, campaigns: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Gather batch.json."""
    asked = [one for one in campaigns if one["status"] != NOT_FITTED]
    spent = [one["cost"]["cpu_s"] for one in campaigns if one.get("cost")]
    return {
        "schema": SCHEMA,
        "folder": folder.name or folder.resolve().name,
        "simulated": any(one.get("simulated") for one in campaigns),
        "usable": bool(asked) and all(one["status"] == USABLE for one in asked),
        "campaigns": [dict(one) for one in campaigns],
        "quantities": quantities(campaigns),
        "cost": {"cpu_s": round(sum(s for s in spent if s is not None), 3)},
        "versions": versions(),
    }


def quantities(campaigns: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """What the usable fits say of every quantity of the rig, by label.

    Numbers of a record (its flow fraction, its preload) are settings, not properties: left out.
    """
    usable = [(n, one) for n, one in enumerate(campaigns) if one["status"] == USABLE]
    labels = dict.fromkeys(
        label for _, one in usable for label in one["parameters"] if label not in one["settings"]
    )
    found: dict[str, Drift] = {}
    for label in labels:
        there = [(n, one["parameters"][label]) for n, one in usable if label in one["parameters"]]
        low, middle, high = (
            np.array([np.nan if p[key] is None else p[key] for _, p in there], dtype=float)
            for key in ("q05", "median", "q95")
        )
        told = drift(middle, low, high, np.array([n for n, _ in there], dtype=float))
        if told is not None:
            found[label] = told
    tests = sum(one.tests for one in found.values())
    unit = {label: p["unit"] for _, one in usable for label, p in one["parameters"].items()}
    return {k: _quantity(one, unit[k], max(tests, 1)) for k, one in found.items()}


def _quantity(one: Drift, unit: str, tests: int) -> dict[str, Any]:
    return {
        "unit": unit,
        "verdict": one.verdict(tests),
        "mean": finite(one.mean),
        "error": finite(one.error * abs(one.mean) if one.logarithmic else one.error),
        "relative": one.logarithmic,
        "change_per_campaign": finite(one.slope),
        "change_error": finite(one.slope_error),
        "trend_p": finite(one.trend_p),
        "scatter_p": finite(one.scatter_p),
    }
