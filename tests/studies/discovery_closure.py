"""How much of the excess misfit closes on left-out blocks once the named effect is in the model.

Every second eighth of one record of each kind (and of the one record that knows of a local cause)
is left out of the fits without and with the effect that was named, in the programs that discovery
used; there the fit's noiseless reading is compared with the one that the generator knows. Misfit
is the sum of squares of the difference over the noise; of it, what the noise of the fitted samples
makes of any model's numbers (the trace of their covariance, carried to the readings) is no excess.
What closes is one less the excess with the effect over that without. The placebo is an effect of
another equation, whose trace has a cosine below 0.5 with that of the named one, with as many
parameters (or as near as there are).
"""

import math
from typing import NamedTuple

import numpy as np
from discovery_cases import Made

from rigid.discovery.fitted import Fitted
from rigid.discovery.outcome import Outcome
from rigid.discovery.refit import NO_LEAD, begin, refit
from rigid.generator.refit import Key, noiseless
from rigid.likelihood.tracks import Track
from rigid.localfit.ascent import refined
from rigid.localfit.local import LocalFit, with_weights
from rigid.localfit.samples import data_of

LEFT_OUT = ("frame-3,A", "free-run-2,A", "release-2,A")
BLOCKS = 8
APART = 0.5


class Misfit(NamedTuple):
    """Squared misfit on the left-out samples, and the part that noise makes of any model."""

    total: float
    noise: float

    @property
    def excess(self) -> float:
        return self.total - self.noise


def closures(outcome: Outcome, made: Made) -> dict[str, float | str | None]:
    """Part of the excess that closes with what was named first and with a placebo.

    Gives None where nothing was named.
    """
    if not outcome.steps or outcome.steps[0].chosen is None:
        return {"named": None, "placebo": None}
    step = outcome.steps[0]
    one = step.refits[step.chosen or ""]
    truth = flat_truth(one.before, made)
    local = [where for told in made.truth.hidden for where in told.records]
    out = {*LEFT_OUT, *(local if len(local) == 1 else ())}
    before, after = (misfit(fit, out, truth) for fit in (one.before, one.after))
    name = placebo(outcome, made)
    found = None
    if name is not None:
        fit = Fitted(one.before, outcome.bench.programs)
        other = refit(fit, step.explained, begin(fit, step.explained, name), NO_LEAD)
        found = _closed(misfit(other.before, out, truth), misfit(other.after, out, truth))
    return {
        "named": _closed(before, after), "placebo": found, "placebo_name": name,
        "before": before.total, "before_noise": before.noise,
        "after": after.total, "after_noise": after.noise,
    }  # fmt: skip


def _closed(before: Misfit, after: Misfit) -> float:
    return 1.0 - after.excess / before.excess


def placebo(outcome: Outcome, made: Made) -> str | None:
    """An effect of another equation and trace, with as many parameters as the named one."""
    step = outcome.steps[0]
    found = step.explained
    mine = found.listed[found.best_of(step.chosen or "")].effect
    equations = {told.equation for told in made.truth.hidden} | {mine.equation}
    cosines = found.screening.cosines[found.best_of(mine.name)]
    numbers = outcome.base.hypothesis.brought_by
    wanted = len(numbers(mine))
    others = {
        name: found.listed[found.best_of(name)].effect
        for name in found.effects
        if abs(cosines[found.best_of(name)]) < APART
    }
    apart = {name: e for name, e in others.items() if e.equation not in equations and e.steady}
    return min(apart, key=lambda name: abs(len(numbers(apart[name])) - wanted), default=None)


def flat_truth(local: LocalFit, made: Made) -> np.ndarray:
    """The generator's noiseless reading of every sample (n,); NaN where its record has none."""
    layout, truth = local.layout, noiseless(made.truth, made.hidden)
    tracks = {t.label: t for t in layout.problem.tracks}
    out = np.full(len(layout.time), math.nan)
    for number, channel in enumerate(layout.channels):
        rows, track = np.flatnonzero(layout.channel == number), tracks[channel.track]
        known = truth[Key(track.name, track.cylinder, channel.quantity)]
        at = np.arange(len(rows)) + _offset(track, made)
        here = (at >= 0) & (at < len(known))
        out[rows[here]] = known[at[here]]
    return out


def misfit(local: LocalFit, out: set[str], truth: np.ndarray) -> Misfit:
    """Misfit of a fit without some blocks of the records `out`, on these blocks."""
    layout = local.layout
    rows = _left_out(local, out) & layout.read & np.isfinite(truth)
    kept = refined(with_weights(local, np.where(rows, 0.0, layout.weight)))
    expected = data_of(layout) - kept.residual  # gains and zeros of the sensors in it
    off = ((expected - truth) / layout.floor)[rows]
    design = kept.design[rows] / layout.floor[rows, None]
    noise = float(np.einsum("ni,ij,nj->", design, kept.covariance, design))
    return Misfit(float(off @ off), noise)


def _left_out(local: LocalFit, out: set[str]) -> np.ndarray:
    """Which samples (n,) are left out: every second of eight blocks."""
    layout = local.layout
    found = np.zeros(len(layout.time), dtype=bool)
    for number, channel in enumerate(layout.channels):
        if channel.track in out:
            rows = np.flatnonzero(layout.channel == number)
            end = int(np.flatnonzero(layout.read[rows]).max(initial=0)) + 1
            found[rows] = np.arange(len(rows)) * BLOCKS // end % 2 == 1
    return found


def _offset(track: Track, made: Made) -> int:
    """Number in the file of a track's first sample; a release is cut at its lead."""
    run = next(r for r in made.truth.runs if f"{r.name},{r.cylinder}" == track.label)
    begin = run.file_start if run.kind == "release" else float(track.first)
    return round((float(track.first) - begin) / track.interval)
