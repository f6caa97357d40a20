"""The campaigns of the discovery benchmark: what is hidden in each, and how it is made.

The mixture is fixed here, before any of its seeds is drawn; development uses seeds below
FIRST_SEED.
"""

import dataclasses
import math
from pathlib import Path
from typing import NamedTuple

from rigid.generator import Conditions, Truth, campaign
from rigid.generator.campaign import drawn
from rigid.generator.conditions import NOMINAL, NULLS, secret
from rigid.generator.draw import SENSORS, Secret, stream
from rigid.generator.hidden import CATALOGUED, OUTSIDE, Hidden, hide
from rigid.generator.strength import at_strength, ground

FIRST_SEED = 960_000
"""Those from 900_000 on were looked at before pairs of effects were weighed, those from 910_000 on
before weak effects had a place in their priors and a fit that stalls renewed its slopes, those from
930_000 on before derivatives of slow records left out the bow of long steps, those from 940_000 on
before what traces take from noise was given back and sensors could answer to other quantities,
those from 950_000 on before a ripple could be in all records and a pump change its stage where
records just reach it."""
MENDED, ANEW = ("pump-stage-switch", "pump-ripple", "clock-offset"), 2_000
"""Effects that were put right when half of the campaigns had been run: a pump that acted on what
flows to the tank, a switch of unknown sharpness, a late pressure that lost its jumps. Every
campaign that hides one, whatever had been said of it, was dropped and has a new seed, so far on."""
CLOCK = 1
IN_BASE = "frequency-dependent-friction"
"""In the model of calibration.toml from the start, so that it cannot be missing there."""
NAMES = tuple(name for name in CATALOGUED if name != IN_BASE)
ALIASED = {
    "free-runs": ("coulomb-friction", "constant-force", "return-spring", "hose-pressure-drop"),
    "frames": ("seating-slack", "constant-force", "entrained-air", "load-cell-stiffening"),
}
"""Effects that a parameter or a sibling absorbs where there are records of one kind only."""
PAIRS = 90
BEHIND, STRONG = 60, 20.0
"""Campaigns in which an effect has a cause without an entry beside it, and the strength of both."""


class Case(NamedTuple):
    """One campaign.

    - hide: names; strength: of each. - condition: of NULLS. - noise: over the usual, which the
      spec then states. - without: taken out of the catalogue. - records: which the spec keeps.
    - first: seed of the first campaign of all.
    """

    number: int
    population: str
    hide: tuple[str, ...] = ()
    strength: float = 0.0
    condition: str = ""
    noise: float = 1.0
    without: tuple[str, ...] = ()
    records: str = "all"
    first: int = FIRST_SEED

    @property
    def seed(self) -> int:
        """One seed a campaign."""
        anew = self.first == FIRST_SEED and set(self.hide) & set(MENDED)
        return self.first + self.number + ANEW * bool(anew)


def cases(size: str, first: int = FIRST_SEED) -> list[Case]:
    """List the campaigns of a size, `small` or `standard`, with seeds from the first on."""
    listed = _small() if size == "small" else _standard()
    return [case._replace(number=number, first=first) for number, case in enumerate(listed)]


def _small() -> list[Case]:
    """One or two of every kind: whether all of it works, not how well."""
    names = ("coulomb-friction", "piston-leakage", "load-cell-drift", "valve-event")
    found = [Case(0, "clean") for _ in range(4)]
    found += [Case(0, "hard", condition=name) for name in NULLS]
    found += [Case(0, "single", (name,), 8.0) for name in names]
    found += [Case(0, "taken out", (name,), 8.0, without=(name,)) for name in names[:2]]
    found += [Case(0, "outside", (name,), 8.0) for name in list(OUTSIDE)[:2]]
    found += [Case(0, "pair", ("coulomb-friction", "piston-leakage"), 8.0)]
    found += [Case(0, "aliased", (ALIASED["frames"][0],), 8.0, records="frames")]
    found += [Case(0, "uneven", ("piston-leakage",), 8.0, records="no pressure")]
    found += [Case(0, "behind", (next(iter(OUTSIDE)), "piston-leakage"), STRONG)]
    return found


def _standard() -> list[Case]:
    """All populations, as many of each as a bound on their shares takes."""
    nulls = list(NULLS)
    found = [Case(0, "clean") for _ in range(200)]
    found += [Case(0, "hard", condition=nulls[i % len(nulls)]) for i in range(200)]
    lows, highs = (1.0, 2.0, 3.0, 2.0, 3.0), (8.0, 12.0, 8.0, 12.0, 8.0)
    noises = (1.0, 0.5, 1.0, 2.0, 4.0)
    for name in NAMES:
        for low, high, noise in zip(lows, highs, noises, strict=True):
            found += [Case(0, "single", (name,), s, noise=noise) for s in (low, 5.0, high)]
    for name in NAMES:
        for strength in (5.0, 8.0, 8.0, 8.0, 12.0):
            found.append(Case(0, "taken out", (name,), strength, without=(name,)))
    for name in OUTSIDE:
        for strength in (3.0, 5.0, 8.0, 8.0, 12.0):
            found.append(Case(0, "outside", (name,), strength))
    every = [(a, b) for i, a in enumerate(NAMES) for b in NAMES[i + 1 :]]
    found += [Case(0, "pair", every[len(every) * i // PAIRS], 8.0) for i in range(PAIRS)]
    for records, names in ALIASED.items():
        for i in range(24):
            found.append(Case(0, "aliased", (names[i % 4],), 8.0, records=records))
    for i in range(52):
        records = ("no release", "no stroke", "no pressure", "no load")[i % 4]
        found.append(Case(0, "uneven", (NAMES[i % len(NAMES)],), 8.0, records=records))
    unlisted = list(OUTSIDE)
    for i in range(BEHIND):
        both = unlisted[i % len(unlisted)], NAMES[i // 2 % len(NAMES)]
        found.append(Case(0, "behind", both, STRONG))
    return found


class Made(NamedTuple):
    """A campaign in files: its spec, its truth, and what is hidden in it."""

    spec: Path
    truth: Truth
    hidden: tuple[Hidden, ...]


def make(case: Case, folder: Path) -> Made:
    """Write a campaign; raises ValueError where a strength cannot be reached with its records."""
    usual = NULLS[case.condition] if case.condition else NOMINAL
    conditions = dataclasses.replace(
        usual, clock=CLOCK, noise_factor=usual.noise_factor * case.noise
    )
    hidden, secrets = _hidden(case, conditions)
    conditions = dataclasses.replace(conditions, hidden=hidden)
    truth = campaign(case.seed, folder, field=False, conditions=conditions, secrets=secrets)
    path = folder / "calibration.toml"
    path.write_text(edited(path.read_text(encoding="ascii"), case), encoding="ascii")
    return Made(path, truth, hidden)


def _hidden(
    case: Case, conditions: Conditions
) -> tuple[tuple[Hidden, ...], tuple[Secret, ...] | None]:
    """Causes at the strength they have in the records that the spec keeps."""
    if not case.hide:
        return (), None
    truth = drawn(case.seed, conditions, field=False)
    seen = left(truth, case.records)
    on = ground(seen)
    found = [
        at_strength(on, hide(name, stream(case.seed, "hidden", name), seen.runs), case.strength)
        for name in case.hide
    ]
    secrets = tuple(secret(truth, cause, strength) for cause, strength in found)
    return tuple(cause for cause, _ in found), secrets


def left(truth: Truth, records: str) -> Truth:
    """Give the truth with the records and channels that a spec keeps."""
    kinds = {"frames": {"frame"}, "free-runs": {"free-run"}, "no release": {"frame", "free-run"}}
    if records in kinds:
        runs = tuple(run for run in truth.runs if run.kind in kinds[records])
        return dataclasses.replace(truth, runs=runs)
    channel = records.removeprefix("no ") + ","
    # A channel that nobody reads says as much as one that is all noise.
    sensors = {
        name: dataclasses.replace(s, noise=math.inf) if name.startswith(channel) else s
        for name, s in truth.sensors.items()
    }
    return dataclasses.replace(truth, sensors=sensors)


def edited(spec: str, case: Case) -> str:
    """Give the text of a spec with the case's candidates, sheets and records."""
    head, *records = spec.split("[[records]]\n")
    if case.without:
        kept = "".join(f'    "{name}",\n' for name in NAMES if name not in case.without)
        head = head.replace("[model]\n", f"[model]\ncandidates = [\n{kept}]\n", 1)
    if case.noise != 1.0:
        sheets = [f"[sensors.{q}]\nnoise = {case.noise * law[2]}\n" for q, law in SENSORS.items()]
        head += "\n".join(sheets) + "\n"
    kept = [_record(record, case.records) for record in records]
    head = _without(head, case.records)  # the channels of a cylinder stand there
    return head + "".join(f"[[records]]\n{record}" for record in kept if record)


def _record(record: str, kept: str) -> str:
    """Give a record's lines without a channel, or nothing where the spec does not keep it."""
    release, frame = 'kind = "release"' in record, 'kind = "frame"' in record
    if (kept == "frames" and not frame) or (kept == "free-runs" and (frame or release)):
        return ""
    if kept == "no release" and release:
        return ""
    return _without(record, kept)


def _without(text: str, kept: str) -> str:
    """Give lines of a spec without those of a channel, where `kept` is "no CHANNEL"."""
    channel = kept.removeprefix("no ")
    return "".join(
        line for line in text.splitlines(keepends=True) if not line.startswith(f"{channel} = ")
    )
