"""Where the models begin: settings of their numbers through the priors, all else adjusted."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from rigid.friction.models import MEMORY, FrictionModel, Place, amplitude_labels
from rigid.inference.newton import is_noise
from rigid.io.errors import UnusableResultError
from rigid.likelihood.parameters import Parameter
from rigid.localfit.candidates import even_settings, standard_of
from rigid.localfit.evidence import amplitudes, most_probable
from rigid.localfit.expansion import Point
from rigid.localfit.families import Family, read
from rigid.localfit.hypothesis import Hypothesis, widened
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Layout, flat_readings
from rigid.localfit.signature import reads

LEVELS = (-2.5, 0.0)
"""Quantiles of an amplitude's prior at which records are simulated; else it is in proportion."""
SHAPES = {0: 1, 1: 2, 2: 2, 3: 3, 4: 3}
"""Settings of the rest of a model's numbers, by how many there are."""
BRANCH = "mu_branch"
"""Name of the branches' friction."""
SLIGHT = -2.5
"""Quantile of the priors at which what a model has more begins beside a fit without it."""
CARRIED = (0.0, 0.5, 1.0)
"""Shares of the branches' friction that a constant coefficient may have to carry, tried in turn."""


def prior_starts(hypothesis: Hypothesis, layout: Layout, count: int, seed: int) -> list[Point]:
    """Places to begin at without any fit: the centre of the priors, then draws from them.

    Sensors and noise levels begin as their sheets say.
    """
    drawn = np.random.default_rng(seed).standard_normal((count, hypothesis.size))
    drawn[0], drawn[:, len(hypothesis.parameters) :] = 0.0, 0.0
    quiet = np.zeros(int(is_noise(hypothesis.problem).sum()))
    return [Point(hypothesis, layout, w, quiet) for w in drawn]


def memory_starts(constant: LocalFit, like: LocalFit, place: Place) -> list[Point]:
    """Places at which the model with memory may begin, after a fit without.

    - `like`: the model with memory anywhere. Branches are as small as SLIGHT says, what they carry
      is taken off the constant coefficient.
    """
    new, old = like.hypothesis, constant.hypothesis
    known = dict(zip(old.labels, constant.w[: len(old.labels)], strict=True))
    own = np.array([known.get(label, 0.0) for label in new.labels])
    branches = [i for i, p in enumerate(new.parameters) if _is_branch(p, place)]
    own[branches] = SLIGHT
    carried = sum(float(new.parameters[i].prior.from_standard(SLIGHT)) for i in branches)
    viscous = place.label("mu")
    at, (mu, _) = new.labels.index(viscous), old.values(constant.w)[viscous]
    own[at] = standard_of(new.parameters[at].prior, max(mu - carried, 0.5 * mu))
    w = np.concatenate([own, constant.w[len(old.labels) :]])
    return [Point(new, like.layout, w, constant.z_noise)]


def _is_branch(one: Parameter, place: Place) -> bool:
    """Whether a number is the friction of a branch of memory there."""
    return one.base == BRANCH and one.label in place.labels(MEMORY)


def searched_start(base: LocalFit, model: FrictionModel, numbers: Mapping[str, float]) -> Point:
    """Place at which a model of dry friction begins where a search of it alone has ended.

    - `base`: a fit without dry friction. - `numbers`: z by label. Gains and zeros begin as the
      sensors' sheets say, and so does the noise: that of `base` is what the model is to explain.
    """
    hypothesis = of_law(base.hypothesis, model)
    w = np.zeros(hypothesis.size)
    for i, label in enumerate(hypothesis.labels):
        w[i] = numbers.get(model.calls.get(label, label), 0.0)
    return Point(hypothesis, base.layout, w, np.zeros_like(base.z_noise))


class ModelSetting(NamedTuple):
    """A model at one setting of its own numbers: quantiles of their priors, by label."""

    model: FrictionModel
    numbers: Mapping[str, float]


class Starts(NamedTuple):
    """Places to begin at, by model, the best first; changes (n, jobs) of every sample."""

    points: Mapping[str, list[Point]]
    changes: np.ndarray


def constant_starts(memory: LocalFit, model: FrictionModel) -> list[Point]:
    """Places at which the constant model may begin, after a fit with memory."""
    old = memory.hypothesis
    new = dataclasses.replace(old, held=dict(model.held))
    own = np.array([label not in model.held for label in old.labels])
    sensors = np.ones(len(memory.w) - len(own), dtype=bool)
    w = memory.w[np.concatenate([own, sensors])]
    values = old.every(memory.w)
    branches = sum(values[p.label] for p in old.parameters if _is_branch(p, model.place))
    viscous = model.place.label("mu")
    at, out = new.labels.index(viscous), []
    for share in CARRIED:
        begun = w.copy()
        begun[at] = standard_of(new.parameters[at].prior, values[viscous] + share * branches)
        out.append(Point(new, memory.layout, begun, memory.z_noise))
    return out


def of_law(base: Hypothesis, model: FrictionModel) -> Hypothesis:
    """The hypothesis of a model of dry friction, from that of the model without any."""
    assert model.dry is not None
    held, given = dict(base.held) | dict(model.held), dict(base.given) | dict(model.given)
    return dataclasses.replace(base, added=(model.dry,), held=held, given=given)


def larger_start(smaller: LocalFit, base: LocalFit, model: FrictionModel) -> Point:
    """Place at which a model of dry friction begins beside a fit of one that it contains.

    - `base`: a fit without dry friction. What the smaller model lacks is as small as SLIGHT says,
      or where its prior is centred.
    """
    old, new = smaller.hypothesis, of_law(base.hypothesis, model)
    values = old.every(smaller.w)
    known = set(old.labels)
    own = [
        standard_of(p.prior, values[label]) if label in known else SLIGHT * (old.held[label] == 0.0)
        for label, p in zip(new.labels, new.parameters, strict=True)
    ]
    w = np.concatenate([own, smaller.w[len(old.labels) :]])
    return Point(new, smaller.layout, w, smaller.z_noise)


def dry_starts(
    base: LocalFit, family: Family, listed: Sequence[FrictionModel], most: Mapping[str, int]
) -> Starts:
    """The best points to begin at beside a fit without dry friction.

    - `family`: the program that holds the models. - `most`: how many of each; 1 where not said.

    Each setting is simulated at LEVELS of its amplitude; all other numbers follow by the parabola
    around `base`, and so does the amplitude away from the levels. Settings that cannot be simulated
    are left out.

    Raises UnusableResultError where none of a model's can.
    """
    hypotheses = {model.name: of_law(base.hypothesis, model) for model in listed}
    jobs = [
        ModelSetting(model, z) for model in listed for z in _settings(hypotheses[model.name], model)
    ]
    changes = _changes(base, family, [(hypotheses[j.model.name], j) for j in jobs])
    able = np.all(np.isfinite(changes), axis=0).tolist()
    jobs, changes = [job for job, ok in zip(jobs, able, strict=True) if ok], changes[:, able]
    solved = cho_factor(base.information)
    points: dict[str, list[tuple[float, Point]]] = {model.name: [] for model in listed}
    for job, change in zip(jobs, changes.T, strict=True):
        hypothesis = hypotheses[job.model.name]
        shared = base.design.T @ (base.terms.curvature * change)
        slope = change @ base.terms.score - shared @ cho_solve(solved, base.gradient)
        curvature = change @ (base.terms.curvature * change) - shared @ cho_solve(solved, shared)
        label = amplitude_labels(job.model, hypothesis.given)[-1]
        prior = next(p.prior for p in hypothesis.parameters if p.label == label)
        size = float(prior.from_standard(job.numbers[label]))
        best = most_probable(slope / size, curvature / size**2, amplitudes(prior, 0.0))
        share = float(prior.from_standard(best)) / size
        numbers = dict(job.numbers) | {label: best}
        moved = base.w + cho_solve(solved, base.gradient - share * shared)
        w = widened(base.hypothesis, moved, numbers.values())
        point = Point(hypothesis, base.layout, w, base.z_noise)
        cost = 0.5 * sum(z * z for z in numbers.values())
        points[job.model.name].append((share * slope - 0.5 * share**2 * curvature - cost, point))
    if nowhere := [model.words for model in listed if not points[model.name]]:
        raise UnusableResultError(
            f"friction that is {' or '.join(nowhere)} can be simulated at no setting of its "
            "priors: state priors of its numbers in [priors], or more steps in [solve]"
        )
    ranked = {name: sorted(p, key=lambda one: -one[0]) for name, p in points.items()}
    return Starts({n: [p for _, p in r[: most.get(n, 1)]] for n, r in ranked.items()}, changes)


def _own(hypothesis: Hypothesis) -> list[Parameter]:
    """Uncertain numbers of what was added."""
    (effect,) = hypothesis.added
    return [p for p in hypothesis.brought_by(effect) if p.label not in hypothesis.held]


def _settings(hypothesis: Hypothesis, model: FrictionModel) -> list[dict[str, float]]:
    """Quantiles of a model's own numbers, by label, in the order of its parameters."""
    labels = [p.label for p in _own(hypothesis)]
    amplitude = amplitude_labels(model, hypothesis.given)[-1]
    free = [label for label in labels if label != amplitude]
    shapes = even_settings(len(free), SHAPES[len(free)], 0)
    return [
        {label: dict(zip(free, shape, strict=True)).get(label, level) for label in labels}
        for shape in shapes.tolist()
        for level in LEVELS
    ]


def _changes(
    base: LocalFit, family: Family, jobs: Sequence[tuple[Hypothesis, ModelSetting]]
) -> np.ndarray:
    """Change of every sample's expected reading by each job (n, jobs)."""
    every = dict(family.quiet) | base.hypothesis.every(base.w)
    lanes = [every]
    for hypothesis, job in jobs:
        priors = {p.label: p.prior for p in _own(hypothesis)}
        own = {k: float(priors[k].from_standard(z)) for k, z in job.numbers.items()}
        lanes.append(every | dict(hypothesis.held) | own)
    values = {k: np.array([lane[k] for lane in lanes]) for k in every}
    reading = flat_readings(base.layout, read(family, values))
    return (reading[:, 1:] - reading[:, :1]) * reads(base)[:, None]
