"""What all steps of a discovery share: programs, candidates, and what each would leave."""

import dataclasses
import json

import numpy as np

from rigid.discovery.fitting.candidates import EVENT, Candidate, candidates, events
from rigid.discovery.fitting.families import Effects, Family
from rigid.discovery.fitting.local import Local
from rigid.discovery.fitting.traces import traces
from rigid.discovery.lines import Line, lines
from rigid.discovery.unseen.bumps import Bumps, Target, bumps, together
from rigid.discovery.unseen.crosstalk import crosstalk
from rigid.discovery.unseen.shifts import shifts
from rigid.discovery.unseen.straight import straight
from rigid.discovery.unseen.waves import waves
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
    placed = [e for e in effects if e.name == EVENT or e.beat is not None]
    given = dict(base.hypothesis.given)
    spread = candidates([e for e in effects if e not in placed], SHAPES, given)
    spread += tuple(o for e in placed if e.name == EVENT for o in events(e, tracks, given))
    beating = [e for e in placed if e.beat is not None]

    def make() -> Arrays:
        curves = bumps(base, programs[0])
        hidden = together([curves, waves(base), shifts(base), straight(curves), crosstalk(base)])
        beats = [lines(base, programs, e) for e in beating]
        return {
            "traces": np.concatenate(
                [traces(base, programs, spread), *(c for _, c in beats)], axis=1
            ),
            "lines": np.array(json.dumps([found for found, _ in beats])),
            "columns": hidden.columns,
            "centre": hidden.centre,
            "target": np.array(json.dumps(hidden.target)),
        }

    found = shelf.once(KEPT, make)
    beats = json.loads(str(found["lines"]))
    beating_alone = tuple(
        Line(*one).candidate(effect, given)
        for effect, each in zip(beating, beats, strict=True)
        for one in each
    )
    target = tuple(Target(*one) for one in json.loads(str(found["target"])))
    return Bench(
        programs,
        spread + beating_alone,
        Bumps(found["columns"], target, found["centre"]),
        found["traces"],
    )
