"""What discovery found: turn by turn, and all of it."""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.discovery.form import OtherForm, other_form
from rigid.discovery.refit import Refit
from rigid.discovery.signatures import Bench
from rigid.discovery.turn import Absorption
from rigid.discovery.unmodelled.base import Inferred
from rigid.discovery.weighing.discrepancy import borne
from rigid.discovery.weighing.explain import Explained
from rigid.discovery.weighing.odds import Odds
from rigid.inference.settled import Settled
from rigid.localfit.candidates import Candidate
from rigid.localfit.families import Family
from rigid.localfit.leave_one_out import HeldOut
from rigid.localfit.local import LocalFit
from rigid.localfit.settled import state_of
from rigid.localfit.where import Where


@dataclasses.dataclass(frozen=True)
class Judged:
    """Without and with an effect: gaps, left-out parts."""

    gap: tuple[float, float]
    held_out_gap: tuple[float, float]
    left: tuple[HeldOut, HeldOut]

    @property
    def gains(self) -> Float[np.ndarray, " parts"]:
        """Log predictive density of each left-out part with the effect, less that without it."""
        return self.left[1].density - self.left[0].density

    @property
    def elpd(self) -> tuple[float, float]:
        """Difference of the log predictive density of left-out parts, and its standard error."""
        difference = self.gains
        spread = float(np.std(difference, ddof=1)) if len(difference) > 1 else 0.0
        return float(difference.sum()), spread * float(np.sqrt(len(difference)))


@dataclasses.dataclass(frozen=True)
class Step:
    """One turn of the workflow.

    - `verdict`: "named", "indistinguishable" or "unnamed". - `explained`: all that was weighed.
    - `said`: the odds of nothing, each effect and something unnamed; with what was left at the end.
    - `refits`: by name. - `chosen`: the effect added, None where none is.
    - `place`, `equation`: where it shows. - `judged`: None where nothing was added.
    - `placebo`: what an effect with another signature explains, as a share of the chosen one;
      median. - `next_record`: what would part the likeliest two, in words.
    - `refused`: why the likeliest effect is not named all the same, by its name; mostly empty.
    - `hidden`: what is known of what has no name, where that is the verdict. - `absorbed`: fits
      without and with it, where what follows is sought behind it.
    - `doubted`: why the fit with the effect is not settled, where something else drives it that
      may come in later; else empty.
    """

    verdict: str
    explained: Explained
    said: Odds
    refits: dict[str, Refit]
    chosen: str | None
    place: Where
    equation: str
    judged: Judged | None
    placebo: float
    next_record: str | None = None
    refused: Mapping[str, str] = dataclasses.field(default_factory=dict)
    hidden: Inferred | None = None
    absorbed: Absorption | None = None
    doubted: str = ""

    @property
    def came_in(self) -> Refit | Absorption | None:
        """Fits without and with what this turn put into the model; None where it put nothing in."""
        return self.absorbed if self.chosen is None else self.refits[self.chosen]

    @property
    def probability(self) -> Mapping[str, float]:
        """Of nothing, each effect and something unnamed."""
        return self.said.probability

    @property
    def tied(self) -> "Tied | None":
        """The likeliest effect and the next, where the records do not part them."""
        if self.verdict != "indistinguishable" or self.chosen is None:
            return None
        chance = self.probability
        rest = [name for name in chance if name in self.explained.effects and name != self.chosen]
        if not rest:
            return None
        return tied(self.explained, self.chosen, max(rest, key=lambda name: chance[name]))


class Tied(NamedTuple):
    """Two effects, each where it explains most, and the amplitude of the first."""

    both: tuple[Candidate, Candidate]
    amplitude: float


def tied(found: Explained, first: str, other: str) -> Tied:
    """Return two effects, each where it explains most, and the amplitude of the first there."""
    mine, its = found.best_of(first), found.best_of(other)
    return Tied((found.listed[mine], found.listed[its]), float(found.screening.estimate[mine]))


def forms_of(steps: Sequence[Step], final: LocalFit) -> dict[str, OtherForm]:
    """In what other form the records want each effect that was added, by its name.

    - `final`: the fit with all that came in: at an earlier one another missing cause would be taken
      for the form.
    """
    found = {
        step.chosen: other_form(final, step.refits[step.chosen].candidate.effect)
        for step in steps
        if step.chosen is not None
    }
    return {name: form for name, form in found.items() if form is not None}


@dataclasses.dataclass(frozen=True)
class Outcome:
    """All of it.

    - `base`: the fit of the model as specified. - `programs`: of all candidates. - `steps`.
    - `last`: what was weighed at the end. - `final`: the fit with all that was added.
    - `forms`: in what other form the records want each effect that was added, by its name.
    """

    base: LocalFit
    programs: tuple[Family, ...]
    bench: Bench
    steps: tuple[Step, ...]
    last: Explained
    last_probability: dict[str, float]
    final: LocalFit
    forms: Mapping[str, OtherForm]

    @property
    def verdict(self) -> str:
        """That of the first step, or that nothing is missing."""
        return self.steps[0].verdict if self.steps else "nothing-missing"

    @cached_property
    def settled(self) -> Settled:
        """Where the fit with all that was added ended, in view of how much that explains."""
        added = [step.came_in.log_bayes for step in self.steps if step.came_in is not None]
        return state_of(self.final, borne(sum(added, 0.0)))

    def before(self, number: int) -> LocalFit:
        """Return the fit around which a step weighed its explanations."""
        for step in reversed(self.steps[:number]):
            if step.came_in is not None:
                return step.came_in.after
        return self.base
