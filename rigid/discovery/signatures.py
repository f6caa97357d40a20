"""What all steps of a discovery share: programs, candidates, and what each would leave."""

import dataclasses
import json

import numpy as np

from rigid.discovery.periodic import Line, lines
from rigid.discovery.unmodelled.bumps import Bumps, Target, bumps, together
from rigid.discovery.unmodelled.crosstalk import crosstalk
from rigid.discovery.unmodelled.shifts import shifts
from rigid.discovery.unmodelled.straight import straight
from rigid.discovery.unmodelled.waves import waves
from rigid.effects import AbstractEffect
from rigid.io.cache import Arrays, Shelf
from rigid.localfit.candidates import EVENT, Candidate, candidates, events, onsets
from rigid.localfit.families import Effects, Family, holding, read
from rigid.localfit.local import Local
from rigid.localfit.signature import lanes_of, traces

SHAPES = 4
"""Settings of an effect's shape that are screened."""
KEPT = "discovery-traces"
"""What the traces are called on the shelf."""


@dataclasses.dataclass(frozen=True)
class Bench:
    """What all steps share: programs, candidates, and what each would leave in the records."""

    programs: tuple[Family, ...]
    listed: tuple[Candidate, ...]
    bumps: Bumps
    traces: np.ndarray


def _top(base: Local, programs: tuple[Family, ...], effect: type[AbstractEffect]) -> float:
    """Greatest pressure [Pa] that a fit expects in any record, told by a gauge or not."""
    family = holding(programs, [effect])
    groups = read(family, lanes_of(base, {}, 1))
    return max(float(g["pressure"].max()) for g in groups if "pressure" in g)


def laid_out(base: Local, programs: tuple[Family, ...], effects: Effects, shelf: Shelf) -> Bench:
    """Work out the traces of all candidates and hidden things around a fit, once a run."""
    given = dict(base.hypothesis.given)
    beating = [e for e in effects if e.beat is not None]
    timed = [e for e in effects if e.name == EVENT]
    late = [e for e in effects if e.threshold is not None]
    rest = [e for e in effects if e not in (*beating, *timed, *late)]
    spread = candidates(rest, SHAPES, given)
    spread += tuple(one for e in timed for one in events(e, base.layout.problem.tracks, given))
    spread += tuple(one for e in late for one in onsets(e, _top(base, programs, e), given))

    def make() -> Arrays:
        curves = bumps(base, programs[0])
        hidden = together([curves, waves(base), shifts(base), straight(curves), crosstalk(base)])
        heard = [(e.name, lines(base, programs, e)) for e in beating]
        beats = [(name, found) for name, found in heard if found is not None]
        columns = [column[:, None] for _, (_, column) in beats]
        return {
            "traces": np.concatenate([traces(base, programs, spread), *columns], axis=1),
            "lines": np.array(json.dumps({name: line for name, (line, _) in beats})),
            "columns": hidden.columns,
            "centre": hidden.centre,
            "target": np.array(json.dumps(hidden.target)),
        }

    found = shelf.once(KEPT, make)
    beats = json.loads(str(found["lines"]))
    beats = tuple(Line(*beats[e.name]).candidate(e, given) for e in beating if e.name in beats)
    target = tuple(Target(*one) for one in json.loads(str(found["target"])))
    return Bench(
        programs,
        spread + beats,
        Bumps(found["columns"], target, found["centre"]),
        found["traces"],
    )
