"""How much of the excess misfit closes on left-out blocks once the named effect is in the model.

Every second eighth of one record of each kind (and of the one record that knows of a local cause)
is left out of a fit; there the fit's noiseless reading is compared with the one that the generator
knows. Excess is the sum of squares of the difference over the noise. What closes is one less the
excess with the effect over that without. The placebo is an effect of another equation, with as many
parameters as the one that was named (or as near as there are).
"""

import math
from collections.abc import Iterable, Mapping

import numpy as np
from discovery_cases import NAMES, Made

from rigid.assemble import assemble
from rigid.effects import CATALOGUE
from rigid.errors import InputError
from rigid.generator.refit import Key, noiseless
from rigid.problem import Problem, predict
from rigid.records.read import read_records
from rigid.search import search
from rigid.spec import Spec, load_spec

LEFT_OUT = ("frame-3,A", "free-run-2,A", "release-2,A")
BLOCKS = 8
STARTS = 2


def closures(made: Made, answer: Mapping, seed: int) -> dict[str, float | None]:
    """Part of the excess that closes, by what is added: `named` (None: nothing was), `placebo`."""
    spec = load_spec(made.spec)
    records = read_records(spec)
    truth = noiseless(made.truth, made.hidden)
    local = [where for told in made.truth.hidden for where in told.records]
    out = {*LEFT_OUT, *(local if len(local) == 1 else ())}

    def excess(more: Iterable[str]) -> float:
        model = spec.model.model_copy(update={"effects": (*spec.model.effects, *more)})
        changed: Spec = spec.model_copy(update={"model": model})
        return _excess(assemble(changed, records), truth, (made, out), seed)

    named = [step["effect"] for step in answer["steps"] if step.get("effect")]
    before = excess(())
    found: dict[str, float | None] = {"named": None, "placebo": None, "before": before}
    if named:
        found["named"] = 1.0 - excess(named) / before
        found["placebo"] = 1.0 - excess([placebo(named[0], made)]) / before
    return found


def placebo(named: str, made: Made) -> str:
    """An effect of another equation than the hidden one, with as many parameters as the named."""
    true = {told.name for told in made.truth.hidden}
    equations = {told.equation for told in made.truth.hidden} | {CATALOGUE[named].equation}
    wanted = len(CATALOGUE[named].parameters())
    others = [n for n in NAMES if n not in true and CATALOGUE[n].equation not in equations]
    return min(others, key=lambda name: abs(len(CATALOGUE[name].parameters()) - wanted))


def _excess(
    problem: Problem, truth: Mapping[Key, np.ndarray], told: tuple[Made, set[str]], seed: int
) -> float:
    """Sum of squares of (fit less truth) over the noise, on the left-out samples; NaN: no fit."""
    made, out = told
    masks = {(p.group, p.quantity): _left_out(problem, p, out) for p in problem.pieces}
    weights = {key: np.where(mask, 0.0, w) for (key, mask), w in zip(
        masks.items(), (np.asarray(p.weight) for p in problem.pieces), strict=True)}  # fmt: skip
    try:
        found = search(problem.with_weights(weights), STARTS, seed)
    except InputError:
        return math.nan
    best = found.optima[0]
    readings = predict(found.problem, best.z[None])
    total = 0.0
    for piece in problem.pieces:
        ideal = np.asarray(piece.reading(readings))[..., 0]
        mask = masks[piece.group, piece.quantity] & (np.asarray(piece.weight) > 0.0)
        for i, number in enumerate(piece.tracks):
            track = problem.groups[piece.group].tracks[number]
            gain, zero = best.standard[problem.sensors.index(piece.sensor(i))]
            read = ideal[:, i] * (1.0 + gain * piece.sheet.spread.gain)
            read = read + zero * piece.sheet.spread.zero
            known = truth[Key(track.name, track.cylinder, piece.quantity)]
            at = np.arange(len(read)) + _offset(track, made)
            here = mask[:, i] & (at >= 0) & (at < len(known))
            sensor = made.truth.sensors[piece.sensor(i)]
            noise = math.hypot(sensor.noise, sensor.step / math.sqrt(12.0))
            total += float(np.sum(((read[here] - known[at[here]]) / noise) ** 2))
    return total


def _left_out(problem: Problem, piece, out: set[str]) -> np.ndarray:
    """Which samples (samples, tracks) are left out: every second of eight blocks."""
    mask = np.zeros(np.asarray(piece.weight).shape, dtype=bool)
    for i, number in enumerate(piece.tracks):
        track = problem.groups[piece.group].tracks[number]
        if track.label in out:
            blocks = np.arange(track.samples) * BLOCKS // track.samples
            mask[: track.samples, i] = blocks % 2 == 1
    return mask


def _offset(track, made: Made) -> int:
    """Number in the file of a track's first sample; a release is cut at its lead."""
    run = next(r for r in made.truth.runs if f"{r.name},{r.cylinder}" == track.label)
    begin = run.file_start if run.kind == "release" else float(track.first)
    return round((float(track.first) - begin) / track.interval)
