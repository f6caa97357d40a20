"""What all steps of a discovery share: programs, candidates, and what each would leave."""

import dataclasses
import json

import numpy as np

from rigid.discovery.bumps import Bumps, Target, bumps
from rigid.discovery.candidates import EVENT, Candidate, candidates, events
from rigid.discovery.families import Effects, Family
from rigid.discovery.local import Local
from rigid.discovery.traces import traces
from rigid.shelf import Arrays, Shelf

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


def laid_out(base: Local, programs: tuple[Family, ...], effects: Effects, shelf: Shelf) -> Bench:
    """Work out the traces of all candidates and hidden things around a fit, once a run."""
    tracks = [t for group in base.layout.problem.groups for t in group.tracks]
    valve = [e for e in effects if e.name == EVENT]
    given = base.hypothesis.given
    listed = candidates([e for e in effects if e not in valve], SHAPES, given)
    listed += tuple(one for effect in valve for one in events(effect, tracks, given))

    def make() -> Arrays:
        hidden = bumps(base, programs[0])
        return {
            "traces": traces(base, programs, listed),
            "columns": hidden.columns,
            "centre": hidden.centre,
            "target": np.array(json.dumps(hidden.target)),
        }

    found = shelf.once(KEPT, make)
    target = tuple(Target(*one) for one in json.loads(str(found["target"])))
    return Bench(
        programs, listed, Bumps(found["columns"], target, found["centre"]), found["traces"]
    )
