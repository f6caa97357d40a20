"""The outcome of a search on disk, so that a resumed run does not search again."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np

from rigid.inference.proposal import MixtureProposal, Mode, ModeWeights
from rigid.inference.scores import weighted
from rigid.inference.search import Found, Optimum
from rigid.io.files import replacing
from rigid.likelihood.correlation import Autoregression
from rigid.likelihood.problem import Problem
from rigid.likelihood.set_aside import without

NAME = "search.npz"


class Searched(NamedTuple):
    """A search, the law over its modes in the chart's coordinates, and how much each mode holds."""

    found: Found
    law: MixtureProposal
    weights: ModeWeights


def save(folder: Path, mark: Mapping[str, str], searched: Searched) -> None:
    """Write a search to `search.npz` of a folder.

    - `mark`: what it depends on, by name; only a run with the same reads it.
    """
    found, law, weights = searched
    arrays: dict[str, np.ndarray] = {
        "mark": np.array(json.dumps(dict(mark), sort_keys=True)),
        "levels": found.levels,
        "aside": found.aside,
        "keys": np.array(json.dumps(list(found.correlation))),
        "times": np.array([a.time for a in found.correlation.values()]),
    }
    for i, one in enumerate(found.correlation.values()):
        arrays[f"coefficients_{i}"] = one.coefficients
    for name in ("z", "standard", "covariance", "log_posterior", "reached", "away"):
        arrays[f"optimum_{name}"] = np.stack([np.asarray(getattr(o, name)) for o in found.optima])
    for name in ("mean", "covariance_factor", "log_posterior"):
        arrays[f"law_{name}"] = np.stack([np.asarray(getattr(m, name)) for m in law.modes])
    arrays |= {"law_weights": law.weights, "law_dof": np.array(law.dof)}
    for name, value in asdict(weights).items():
        arrays[f"weights_{name}"] = np.asarray(value)
    with replacing(folder / NAME) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load(folder: Path, mark: Mapping[str, str], problem: Problem) -> Searched | None:
    """Read back what `save` wrote, or return None where there is nothing that fits.

    - `problem`: before the search; that of the result has the weights for the correlation found.
    """
    try:
        with np.load(folder / NAME, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays["mark"]) != json.dumps(dict(mark), sort_keys=True):
            return None
        keys = [(int(g), str(q), int(t)) for g, q, t in json.loads(str(arrays["keys"]))]
        correlation = {
            key: Autoregression(arrays[f"coefficients_{i}"], float(arrays["times"][i]))
            for i, key in enumerate(keys)
        }
        names = ("z", "standard", "covariance", "log_posterior", "reached", "away")
        columns = zip(*(arrays[f"optimum_{name}"] for name in names), strict=True)
        optima = tuple(Optimum(z, s, c, float(p), int(n), float(a)) for z, s, c, p, n, a in columns)
        columns = (arrays[f"law_{n}"] for n in ("mean", "covariance_factor", "log_posterior"))
        modes = tuple(Mode(m, f, float(p)) for m, f, p in zip(*columns, strict=True))
        law = MixtureProposal(modes, arrays["law_weights"], float(arrays["law_dof"]))
        weights = ModeWeights(
            weights=arrays["weights_weights"],
            error=arrays["weights_error"],
            log_evidence=float(arrays["weights_log_evidence"]),
            kish=float(arrays["weights_kish"]),
            pareto_k=float(arrays["weights_pareto_k"]),
            failed=int(arrays["weights_failed"]),
        )
    except (OSError, KeyError, ValueError, BadZipFile):
        return None  # not there or damaged: the search runs again and ends in the same place
    levels = arrays["levels"]
    known = weighted(without(problem, arrays["aside"]), correlation)
    found = Found(known, optima, correlation, len(levels), levels, arrays["aside"])
    return Searched(found, law, weights)
