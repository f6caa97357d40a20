"""A model under test: the one specified, with effects added, and its parameters as one vector.

The vector w holds the model's uncertain numbers on the scale where their priors are standard
normal, noise levels left out: those of the problem, those of what was added, then gain and zero of
every sensor, then those of what was absorbed.
"""

import dataclasses
from collections.abc import Container, Iterable, Iterator, Mapping
from functools import cached_property
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from rigid.effects import AbstractEffect
from rigid.inference.newton import is_noise
from rigid.io.compiled import compiled
from rigid.likelihood.listing import of_effect, of_records
from rigid.likelihood.parameters import Parameter
from rigid.likelihood.priors import AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.candidates import priors_of


class Absorbed(NamedTuple):
    """A cause of unknown law that a model has absorbed, as a sum of signatures.

    - `name`. - `columns` (n, m): change of every reading by one prior sd of each of its numbers.

    To first order it is a latent force, flow or sensor error with a Gaussian prior.
    """

    name: str
    columns: Float[np.ndarray, "n m"]

    @property
    def labels(self) -> list[str]:
        """Labels of its numbers."""
        return [f"{self.name}[{i}]" for i in range(self.columns.shape[1])]


@dataclasses.dataclass(frozen=True)
class Hypothesis:
    """The effects of a problem and those `added`.

    - `only`: the record ("record,cylinder") that an added effect is confined to, by its name.
    - `given`: priors by label that go before those of the effects added.
    - `held`: numbers, of the problem or of what was added, that stay at a value, by label.
    - `absorbed`: causes without a law, in the order in which they came in.
    """

    problem: Problem
    added: tuple[type[AbstractEffect], ...] = ()
    only: Mapping[str, str] = dataclasses.field(default_factory=dict)
    given: Mapping[str, AbstractPrior] = dataclasses.field(default_factory=dict)
    held: Mapping[str, float] = dataclasses.field(default_factory=dict)
    absorbed: tuple[Absorbed, ...] = ()

    def plus(
        self,
        effect: type[AbstractEffect],
        only: str | None = None,
        given: Mapping[str, AbstractPrior] | None = None,
    ) -> "Hypothesis":
        """Return the model with one more effect, and more priors that are given."""
        confined = dict(self.only) | ({effect.name: only} if only else {})
        priors = dict(self.given) | dict(given or {})
        return dataclasses.replace(self, added=(*self.added, effect), only=confined, given=priors)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Uncertain numbers in the order of w, sensors and noise levels left out."""
        base = [p for p in self.problem.parameters.sampled if p.base != "noise"]
        more = (p for effect in self.added for p in self.brought_by(effect))
        return tuple(p for p in (*base, *more) if p.label not in self.held)

    def brought_by(self, effect: type[AbstractEffect]) -> list[Parameter]:
        """Uncertain numbers that an effect brings in, with its own priors or those given.

        Some bring numbers of each record, as the angle at which it found the pump.
        """
        each = of_records([effect], self.problem.tracks)
        own = [
            of_effect(info, label, prior)
            for label, (info, prior) in priors_of(effect, self.given).items()
            if not prior.known
        ]
        return own + [dataclasses.replace(p, prior=self.given.get(p.label, p.prior)) for p in each]

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Labels of `parameters`."""
        return tuple(p.label for p in self.parameters)

    @property
    def size(self) -> int:
        """Length of w."""
        return self._ends.stop + sum(one.columns.shape[1] for one in self.absorbed)

    @property
    def _ends(self) -> slice:
        """Where gains and zeros stand in w."""
        numbers = len(self.parameters)
        return slice(numbers, numbers + 2 * len(self.problem.sensors))

    def values(self, w: np.ndarray) -> dict[str, tuple[float, float]]:
        """SI value and its slope by w of each parameter, by label."""
        w, out = np.asarray(w), {}
        for members, prior in self._alike:
            value, slope = _placed(prior, jnp.asarray(w[members]))
            for i, v, s in zip(members, value.tolist(), slope.tolist(), strict=True):
                out[self.labels[i]] = v, s
        return out

    def every(self, w: np.ndarray) -> dict[str, float]:
        """SI values by label of all that is known, held, or in w."""
        return self.constants() | {label: value for label, (value, _) in self.values(w).items()}

    @cached_property
    def _alike(self) -> list[tuple[np.ndarray, AbstractPrior]]:
        """Parameters whose priors are of one kind, by number, and all their priors as one law."""
        kinds: dict[type[AbstractPrior], list[int]] = {}
        for i, p in enumerate(self.parameters):
            kinds.setdefault(type(p.prior), []).append(i)
        priors = [[self.parameters[i].prior for i in members] for members in kinds.values()]
        together = [jax.tree.map(lambda *a: np.stack(a), *one) for one in priors]
        return [(np.array(m), prior) for m, prior in zip(kinds.values(), together, strict=True)]

    def constants(self) -> dict[str, float]:
        """SI values of what is known or held, and of noise levels' places."""
        return self._known | dict(self.held)

    @cached_property
    def _known(self) -> dict[str, float]:
        """SI values of what the problem knows, and 0 for each noise level."""
        known = {p.label: float(p.prior.from_standard(0.0)) for p in self.problem.parameters.known}
        return known | {p.label: 0.0 for p in self.problem.parameters.sampled if p.base == "noise"}

    def own_of(self, tracks: Container[str]) -> np.ndarray:
        """Which entries of w (size,) belong to some tracks and to none of the others.

        - `tracks`: labels, "record,cylinder". A number that both cylinders of a record share is
          own to the two of them together. Sensors and what varies by kind or cylinder are not.
        """
        inside = np.array([t.label in tracks for t in self.problem.tracks])
        there = np.any(self._own[:, inside], axis=1)
        own = np.logical_and(there, ~np.any(self._own[:, ~inside], axis=1))
        return np.pad(own, (0, self.size - len(self.parameters)))

    @cached_property
    def _own(self) -> np.ndarray:
        """Which of `parameters` belong to which track (parameters, tracks)."""
        places = [(t.name, t.cylinder) for t in self.problem.tracks]
        own = [[p.is_own(*place) for place in places] for p in self.parameters]
        return np.array(own, dtype=bool).reshape(len(own), len(places))

    def sensors(self, w: np.ndarray) -> np.ndarray:
        """Gains and zeros on their standard scale (sensors, 2)."""
        return np.asarray(w)[self._ends].reshape(-1, 2)

    def latent(self, w: np.ndarray) -> Iterator[tuple[slice, Absorbed, np.ndarray]]:
        """What was absorbed: where its numbers stand in w, itself, and its numbers."""
        at = self._ends.stop
        for one in self.absorbed:
            here = slice(at, at + one.columns.shape[1])
            yield here, one, np.asarray(w)[here]
            at = here.stop

    def sigmas(self, z_noise: np.ndarray) -> np.ndarray:
        """Noise level of every sensor (sensors,) [SI]."""
        priors = [p for p in self.problem.parameters.sampled if p.base == "noise"]
        placed = zip(priors, np.asarray(z_noise), strict=True)
        level = self._known | {
            p.label: float(_placed(p.prior, jnp.asarray(z))[0]) for p, z in placed
        }
        return np.array([level[f"noise[{s}]"] for s in self.problem.sensors])


@compiled
def _placed(prior: AbstractPrior, z: Array) -> tuple[Array, Array]:
    """Value of a law at standard normal z, and its slope by it."""
    return jax.jvp(prior.from_standard, (z,), (jnp.ones_like(z),))


def start(problem: Problem, z: np.ndarray, standard: np.ndarray) -> np.ndarray:
    """The vector w of the model as specified, from a search's optimum."""
    return np.concatenate([np.asarray(z)[~is_noise(problem)], np.asarray(standard).ravel()])


def widened(hypothesis: Hypothesis, w: np.ndarray, more: Iterable[float]) -> np.ndarray:
    """Put the numbers of an effect that is added to a hypothesis into its w, before the gains."""
    cut = len(hypothesis.parameters)
    return np.concatenate([w[:cut], np.asarray(list(more), dtype=float), w[cut:]])
