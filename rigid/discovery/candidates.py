"""Candidate effects: what could be missing, with shapes drawn from their priors."""

import dataclasses
from collections.abc import Iterable, Mapping

import numpy as np
from scipy.stats import norm, qmc

from rigid.effects import AbstractEffect, ParameterInfo
from rigid.priors import AbstractLaw, make_law


@dataclasses.dataclass(frozen=True)
class Candidate:
    """One way in which one effect could be there.

    - `effect`. - `amplitude`: label of the parameter that brings it in, `absent`: its value there.
    - `law`: prior of the amplitude. - `shape`: values of the effect's other parameters.
    """

    effect: type[AbstractEffect]
    amplitude: str
    absent: float
    law: AbstractLaw
    shape: Mapping[str, float]


def candidates(
    effects: Iterable[type[AbstractEffect]], shapes: int, seed: int = 0
) -> tuple[Candidate, ...]:
    """List every amplitude of every effect, with `shapes` settings of the rest.

    The settings are a scrambled Sobol sequence through the priors, so that few of them cover much.
    """
    found = []
    for effect in effects:
        laws = {
            label: (info, make_law(prior.law, prior.arguments, label))
            for info in effect.parameters()
            for label, prior in zip(info.labels, info.priors, strict=True)
        }
        amplitudes = [label for label, (info, _) in laws.items() if info.absent is not None]
        free = [n for n, (info, law) in laws.items() if info.absent is None and not law.known]
        settings = _settings(len(free), shapes if free else 1, seed)
        for label in amplitudes:
            info, law = laws[label]
            for setting in settings:
                shape = _shape(laws, dict(zip(free, setting, strict=True)))
                found.append(Candidate(effect, label, float(info.absent or 0.0), law, shape))
    return tuple(found)


def _settings(dimension: int, count: int, seed: int) -> np.ndarray:
    """Standard normal points (count, dimension) that fill their space evenly."""
    if dimension == 0:
        return np.zeros((1, 0))
    points = qmc.Sobol(dimension, rng=seed).random(1 << (count - 1).bit_length())[:count]
    return norm.ppf(np.clip(points, 1e-3, 1.0 - 1e-3))


def _shape(
    laws: Mapping[str, tuple[ParameterInfo, AbstractLaw]], standard: Mapping[str, float]
) -> dict[str, float]:
    """Values of all parameters of an effect but its amplitudes, which are absent."""
    out = {}
    for label, (info, law) in laws.items():
        absent = info.absent
        value = law.from_standard(standard.get(label, 0.0)) if absent is None else absent
        out[label] = float(value)
    return out


def batches(listed: Iterable[Candidate]) -> list[tuple[Candidate, ...]]:
    """Part candidates into lots that one program can hold: no label belongs to two effects.

    Effects that leave a rig steady are kept from those that do not, which take a slower program.
    """
    lots: list[tuple[dict[str, str], bool, list[Candidate]]] = []
    for one in listed:
        labels = set(one.shape)
        for owners, steady, members in lots:
            fits = all(owners.get(label, one.effect.name) == one.effect.name for label in labels)
            if fits and steady == one.effect.steady:
                owners.update(dict.fromkeys(labels, one.effect.name))
                members.append(one)
                break
        else:
            owners = dict.fromkeys(labels, one.effect.name)
            lots.append((owners, one.effect.steady, [one]))
    return [tuple(members) for _, _, members in lots]
