"""The next record that would part two effects which the present records cannot tell apart."""

from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from rigid.localfit.candidates import Candidate, standard_of
from rigid.localfit.families import Family
from rigid.localfit.local import Local, expand
from rigid.localfit.screening import Around, screen
from rigid.localfit.signature import traces

FACTORS = {"kappa": (0.3, 3.0), "preload": (0.5, 2.0)}
"""By how much a record's own settings are varied."""
SETTINGS = {"kappa": "the flow fraction", "preload": "the preload"}


class Proposal(NamedTuple):
    """A record to take.

    - `words`: what it is. - `apart`: s sqrt((1 - c)/2) with it; 1.64 parts the two in 19 of 20.
    """

    words: str
    apart: float

    @property
    def sentence(self) -> str:
        """What to take, and how often it tells the two apart: an oracle, with Phi(apart)."""
        often = float(norm.cdf(self.apart))
        told = "more than 99 %" if often > 0.99 else f"{100 * often:.0f} %"
        return f"{self.words}: with it, the two are told apart in {told} of campaigns"


def next_record(
    base: Local, programs: tuple[Family, ...], pair: tuple[Candidate, Candidate], amplitude: float
) -> Proposal | None:
    """Find the record, like one of those there but otherwise set, that parts a pair best.

    - `amplitude`: of the first of the pair, as it was found.
    """
    here = traces(base, programs, pair)
    best: Proposal | None = None
    for name, factors in FACTORS.items():
        for factor in factors:
            there = _otherwise(base, name, factor)
            if there is None:
                continue
            changed = traces(there, programs, pair)
            for number, track in enumerate(base.layout.tracks):
                if not has_setting(base, name, track):
                    continue
                rows = (base.layout.track == number) & base.layout.read
                apart = _apart(base, there, (here, changed[rows]), rows, amplitude)
                if best is None or apart > best.apart:
                    best = Proposal(worded(base, number, name, factor), apart)
    return best


def worded(base: Local, number: int, name: str, factor: float) -> str:
    """Say which record it is: like number `number`, its setting `name` times `factor`."""
    track = base.layout.problem.track(base.layout.tracks[number])
    return (
        f"{track.of.words} like {track.name} (cylinder {track.cylinder}) at {factor:g} times "
        f"{SETTINGS[name]}"
    )


def has_setting(base: Local, name: str, track: str) -> bool:
    """Whether a record has a setting of some name, and it is uncertain."""
    return any(base.hypothesis.parameters[i].base == name for i in base.hypothesis.of_track(track))


def _otherwise(base: Local, name: str, factor: float) -> Local | None:
    """The fit with one setting of all records multiplied, or None where no record has it."""
    w = otherwise(base, name, factor)
    if w is None:
        return None
    return expand(base.hypothesis, (base.family, base.layout), w, base.z_noise)


def otherwise(base: Local, name: str, factor: float) -> np.ndarray | None:
    """w with one setting of all records multiplied, or None where no record has it."""
    w, found = base.w.copy(), False
    for i, parameter in enumerate(base.hypothesis.parameters):
        if parameter.base == name:
            value = float(parameter.law.from_standard(w[i])) * factor
            w[i], found = standard_of(parameter.law, value), True
    return w if found else None


def _apart(
    base: Local,
    there: Local,
    columns: tuple[np.ndarray, np.ndarray],
    rows: np.ndarray,
    amplitude: float,
) -> float:
    """How far apart a pair is with all records and one more, whose own numbers are its own."""
    track = base.layout.tracks[int(base.layout.track[np.flatnonzero(rows)[0]])]
    own = base.hypothesis.of_track(track)
    new = there.design[rows].copy()
    private = new[:, own]
    new[:, own] = 0.0
    old = np.pad(base.design, ((0, 0), (0, len(own))))
    design = np.concatenate([old, np.concatenate([new, private], axis=1)])
    bend = np.concatenate([base.terms.bend, there.terms.bend[rows]])
    around = Around(np.zeros(len(bend)), bend, design, np.zeros(design.shape[1]))
    found = screen(around, np.concatenate(columns))
    cosine = min(abs(float(found.cosines[0, 1])), 1.0)
    return abs(amplitude) * float(found.size[0]) * float(np.sqrt(0.5 * (1.0 - cosine)))
