"""What all steps of a discovery share: programs, candidates, and what each would leave."""

import dataclasses
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from rigid.discovery.fitted import Fitted
from rigid.discovery.periodic import Line, lines
from rigid.discovery.pickup import picked_up
from rigid.discovery.unmodelled import SORTS
from rigid.discovery.unmodelled.base import AbstractHidden, Bumps, none, together
from rigid.effects.placed import origin
from rigid.io.cache import Shelf
from rigid.localfit.candidates import EVENT, Candidate, candidates, events, onsets
from rigid.localfit.families import Effects, Family, read
from rigid.localfit.noise.leftover import Traces
from rigid.localfit.signature import lanes_of, signatures

SHAPES = 4
"""Settings of an effect's shape that are screened."""
KEPT = "discovery-traces"
"""What the signatures are called on the shelf."""


@dataclasses.dataclass(frozen=True)
class Bench:
    """What all steps share: programs, candidates, and what each would leave in the records.

    - `signatures`: of all candidates, then of everything hidden (`bumps`, which has these too).
    """

    programs: tuple[Family, ...]
    listed: tuple[Candidate, ...]
    bumps: Bumps
    signatures: Float[np.ndarray, "n all"]

    @property
    def traces(self) -> Traces:
        """Signatures, and which of them slow noise looks like."""
        once, hidden = [one.only is not None for one in self.listed], self.bumps.target
        timed = np.array([*once, *(one.timed for one in hidden)], dtype=bool)
        wanders = np.array([*([False] * len(once)), *(one.wanders for one in hidden)], dtype=bool)
        return Traces(self.signatures, timed, wanders)

    def without(self, hidden: AbstractHidden) -> "Bench":
        """Return what is left to weigh once a hidden thing is a part of the model."""
        count = len(self.listed)
        left = [hidden not in (one, one.pooled) for one in self.bumps.target]
        kept = np.flatnonzero(left)
        signatures = self.signatures[:, np.concatenate([np.arange(count), count + kept])]
        target = tuple(self.bumps.target[i] for i in kept)
        bumps = Bumps(signatures[:, count:], target, self.bumps.centre[kept])
        return Bench(self.programs, self.listed, bumps, signatures)


def _top(fit: Fitted) -> float:
    """Greatest pressure [Pa] that a fit expects in any record, told by a gauge or not."""
    groups = read(fit.programs[0], lanes_of(fit.local, {}, 1))
    return max(float(g["pressure"].max()) for g in groups if "pressure" in g)


def hidden_signatures(fit: Fitted, sorts: Iterable[type[AbstractHidden]]) -> Bumps:
    """What everything hidden would leave, sort after sort."""
    found = [none(len(fit.local.residual))]
    for sort in sorts:
        mine = sort.signatures(fit, lambda: together(found))
        if not np.isfinite(mine.columns).all():
            raise ValueError(f"{sort.__module__}: signatures of '{sort.sort}' are not all finite")
        found.append(mine)
    return together(found)


def laid_out(fit: Fitted, effects: Effects, shelf: Shelf) -> Bench:
    """Work out the signatures of all candidates and hidden things around a fit, once a run."""
    base = fit.local
    given = dict(base.hypothesis.given)
    beating = [e for e in effects if e.beat is not None]
    timed = [e for e in effects if origin(e).name == EVENT]
    late = [e for e in effects if e.threshold is not None]
    rest = [e for e in effects if e not in (*beating, *timed, *late)]
    spread = candidates(rest, SHAPES, given)
    spread += tuple(one for e in timed for one in events(e, base.layout.problem.tracks, given))
    spread += tuple(one for e in late for one in onsets(e, _top(fit), given))

    def make() -> tuple[np.ndarray, dict[str, Line], Bumps]:
        hidden = hidden_signatures(fit, SORTS.values())
        searched = {e: (picked_up if e.picked_up() else lines)(fit, e) for e in beating}
        lines_found = {e: line for e, line in searched.items() if line is not None}
        beats = [line.candidate(e, given) for e, line in lines_found.items()]
        both = [signatures(base, fit.programs, some) for some in (spread, beats)]
        return np.concatenate(both, axis=1), {e.name: one for e, one in lines_found.items()}, hidden

    found, lines_found, bumps = shelf.once(KEPT, make, (Line, Bumps, *SORTS.values()))
    beats = tuple(lines_found[e.name].candidate(e, given) for e in beating if e.name in lines_found)
    listed, columns = spread + beats, np.concatenate([found, bumps.columns], axis=1)
    shared = dataclasses.replace(bumps, columns=columns[:, len(listed) :])
    return Bench(fit.programs, listed, shared, columns)
