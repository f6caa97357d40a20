"""The models compared: evidence, probability, left-out records, and what it all amounts to."""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from rigid.friction.fits import FittedModels
from rigid.friction.models import FrictionModel, amplitude_labels
from rigid.friction.prior_widths import AS_STATED, VARIANTS
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.likelihood.priors import AbstractPrior
from rigid.localfit.integral import evidence
from rigid.localfit.leave_one_out import HeldOut, Judged, Rows, left_out, units
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Layout
from rigid.localfit.scatter import Scattered, scattered

MOST_APART = 4.0
"""Nats of log predictive density by which a model that is tied with the first is worse at most."""
DECIDED = float(np.log(20.0))
"""Log odds that decide between a model and a larger one that contains it."""
HOPELESS = 15.0
"""Nats of evidence below the first model from which on no fit is made again for a model."""
LAW, TIED, CANNOT_TELL = "law", "tied", "cannot-tell"
"""Verdicts: one model; one model, and larger ones that the records do not need; several models."""


@dataclasses.dataclass(frozen=True, eq=False)
class Standing:
    """How a model stands.

    - `model`, `local`: its fit. - `left`: of records left out. - `difference` (parts,): of the log
      predictive density to the first model's. - `error`: calibrated standard error of its sum;
      `errors` (parts,) of each part; 0 for the first. - `odds_error`: of the log evidence.
    - `expected`: mean of the sum over campaigns of the first model. - `tied`: with the first.
    - `evidence`, `probability`: log evidence, by variant of the amplitudes' priors, and share.
    """

    model: FrictionModel
    local: LocalFit
    left: HeldOut
    difference: np.ndarray
    errors: np.ndarray
    error: float
    odds_error: float
    expected: float
    tied: bool
    evidence: Mapping[str, float] = dataclasses.field(default_factory=dict)
    probability: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def elpd(self) -> float:
        """Difference of the log predictive density of all left-out parts to the first model's."""
        return float(self.difference.sum())


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """All models, the most probable first.

    - `verdict`: LAW, TIED or CANNOT_TELL. - `parts`: names of what was left out in turn.
    """

    standings: tuple[Standing, ...]
    verdict: str
    parts: tuple[str, ...]
    fitted: FittedModels

    @property
    def first(self) -> Standing:
        """The most probable model."""
        return self.standings[0]

    @property
    def tied(self) -> tuple[Standing, ...]:
        """Laws that the records do not part from the first."""
        return tuple(one for one in self.standings[1:] if one.tied)


def compare(fitted: FittedModels, seed: int, shelf: Shelf = NOTHING_KEPT) -> Comparison:
    """Compare the models that have been fitted.

    - `seed`: of the simulated campaigns. - `shelf`: keeps what the models say of them, and of
      records that were left out.
    """
    layout = next(iter(fitted.fits.values())).layout
    parts = units(next(iter(fitted.fits.values())), None)
    judged = {
        model.name: Judged(fitted.fits[model.name], amplitudes_of(fitted.fits[model.name], model))
        for model in fitted.models
    }
    logs = {name: _variants(one) for name, one in judged.items()}
    variants = next(iter(logs.values()))
    chance = {v: probabilities({n: one[v] for n, one in logs.items()}) for v in variants}
    ranked = sorted(fitted.models, key=lambda model: -chance[AS_STATED][model.name])
    first = ranked[0].name
    stated = {name: one[AS_STATED] for name, one in logs.items()}
    left = shelf.once("left-out", lambda: _left(fitted, judged, stated, parts), (HeldOut,))

    def campaigns(number: int, model: FrictionModel) -> dict[str, Scattered]:
        two = {n: judged[n] for n in (first, model.name)} if number else judged
        return scattered(fitted.fits[model.name], two, parts, seed + number)

    simulated = [
        shelf.once(f"campaigns-{number}", partial(campaigns, number, model), (Scattered,))
        for number, model in enumerate(ranked)
    ]
    standings = []
    for model, own in zip(ranked, simulated, strict=True):
        standing = _standing(model, fitted.fits[model.name], left, first, (simulated[0], own))
        told = {v: p[model.name] for v, p in chance.items()}
        standings.append(dataclasses.replace(standing, evidence=logs[model.name], probability=told))
    names = tuple(_named(layout, rows) for rows in parts)
    verdict = verdict_of([ModelEvidence(one.model, one.evidence, one.tied) for one in standings])
    return Comparison(tuple(standings), verdict, names, fitted)


def _left(
    fitted: FittedModels,
    judged: Mapping[str, Judged],
    logs: Mapping[str, float],
    parts: Sequence[Rows],
) -> dict[str, HeldOut]:
    """What each model says of records left out; those that have a chance are fitted again."""
    best, out = max(logs.values()), dict[str, HeldOut]()
    groups: dict[bool | None, list[str]] = {}
    for model in fitted.models:
        near = logs[model.name] > best - HOPELESS
        groups.setdefault(model.dry is None if near else None, []).append(model.name)
    for viscous, names in groups.items():
        program = None
        if viscous is not None:
            program = fitted.programs.viscous if viscous else fitted.programs.dry
        out |= left_out({name: judged[name] for name in names}, parts, program)
    return out


def _standing(
    model: FrictionModel,
    local: LocalFit,
    left: Mapping[str, HeldOut],
    first: str,
    campaigns: Sequence[Mapping[str, Scattered]],
) -> Standing:
    """How a model stands to the first; `campaigns`: made by the first, and by the model itself."""
    density = [c[model.name].density - c[first].density for c in campaigns]
    logs = [c[model.name].evidence - c[first].evidence for c in campaigns]
    error = max(float(d.sum(axis=1).std()) for d in density)
    difference = left[model.name].density - left[first].density
    return Standing(
        model=model,
        local=local,
        left=left[model.name],
        difference=difference,
        errors=np.max([d.std(axis=0) for d in density], axis=0),
        error=error,
        odds_error=max(float(d.std()) for d in logs),
        expected=float(density[0].sum(axis=1).mean()),
        tied=model.name != first and float(difference.sum()) > -min(error, MOST_APART),
    )


class ModelEvidence(NamedTuple):
    """What a verdict goes by: a model, its log evidence by variant, and if it is tied."""

    model: FrictionModel
    evidence: Mapping[str, float]
    tied: bool


def verdict_of(standings: Sequence[ModelEvidence]) -> str:
    """Say what standings amount to, the first model's before the others'.

    Laws that contain the first and are tied with it are not needed where the odds say so whatever
    the width of their priors; any other tie is one that the records cannot part.
    """
    first = standings[0]
    tied = [one for one in standings[1:] if one.tied]
    needless = [
        one.model.contains(first.model)
        and all(first.evidence[v] - one.evidence[v] > DECIDED for v in first.evidence)
        for one in tied
    ]
    if not tied:
        return LAW
    return TIED if all(needless) else CANNOT_TELL


def probabilities(logs: Mapping[str, float]) -> dict[str, float]:
    """Probabilities of models that are all as probable before any record."""
    total = float(np.asarray(logsumexp(list(logs.values()))))
    return {name: float(np.exp(log - total)) for name, log in logs.items()}


def amplitudes_of(local: LocalFit, model: FrictionModel) -> dict[str, AbstractPrior]:
    """Priors of a model's amplitudes, by label, where they are uncertain."""
    known = {p.label: p.prior for p in local.hypothesis.parameters}
    labels = amplitude_labels(model, local.hypothesis.given)
    return {label: known[label] for label in labels if label in known}


def _variants(one: Judged) -> dict[str, float]:
    """Log evidence under each variant of the amplitudes' priors."""
    return {
        name: evidence(one.local, {label: change(prior) for label, prior in one.amplitudes.items()})
        for name, change in VARIANTS.items()
    }


def _named(layout: Layout, rows: np.ndarray) -> str:
    """Name of a part: its record, and the stretch of it where there is one record only."""
    track = layout.tracks[int(layout.track[np.flatnonzero(rows)[0]])]
    if len(layout.tracks) > 1:
        return track
    times = layout.time[rows]
    return f"{track} {times.min():.2f}-{times.max():.2f} s"
