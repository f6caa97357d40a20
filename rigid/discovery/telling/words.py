"""Effects and their numbers in words, for a reader who has not seen the catalogue."""

from collections.abc import Mapping

from rigid.discovery.fitting.hypothesis import Hypothesis
from rigid.discovery.weighing.explain import Explained

KAPPA = "share of the flow that the valve passes"


def introduced(found: Explained, name: str) -> str:
    """An effect with its phrase: "piston-leakage: oil leaks past the piston"."""
    phrase = next((one.effect.phrase for one in found.listed if one.effect.name == name), "")
    return f"{name}: {phrase}" if phrase else name


def meanings(hypothesis: Hypothesis) -> dict[str, str]:
    """What the numbers of a model mean, by label; those of each record by their common name."""
    effects = (*hypothesis.problem.effects, *hypothesis.added)
    infos = [info for effect in effects for info in effect.parameters()]
    return {"kappa": KAPPA} | {label: info.meaning for info in infos for label in info.labels}


def meaning(label: str, among: Mapping[str, str]) -> str:
    """What a number means, "" where nothing is said of it; `among` as `meanings` gives it."""
    return among.get(label) or among.get(label.split("[")[0], "")


def called(label: str, means: str) -> str:
    """A number for a sentence: "bulk modulus of the oil (k_oil)"."""
    return f"{means} ({label})" if means else label
