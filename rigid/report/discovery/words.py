"""Effects and their numbers in words, for a reader who has not seen the catalogue."""

from rigid.discovery.weighing.explain import Explained
from rigid.localfit.hypothesis import Hypothesis

KAPPA = "share of the flow that the valve passes"


def introduced(found: Explained, name: str) -> str:
    """An effect with its phrase: "piston-leakage: oil leaks past the piston"."""
    phrase = next((one.effect.phrase for one in found.listed if one.effect.name == name), "")
    return f"{name}: {phrase}" if phrase else name


def meanings(hypothesis: Hypothesis) -> dict[str, str]:
    """What every number of a model means, by label; "" where nothing is said of it."""
    effects = (*hypothesis.problem.effects, *hypothesis.added)
    told = {info.name: info.meaning for effect in effects for info in effect.parameters()}
    told["kappa"] = KAPPA
    return {p.label: told.get(p.base, "") for p in hypothesis.parameters}


def called(label: str, means: str) -> str:
    """A number for a sentence: "bulk modulus of the oil (k_oil)"."""
    return f"{means} ({label})" if means else label
