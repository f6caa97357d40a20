"""Does the comparison of friction laws find the law that made the records, and know when it cannot?

    python tests/studies/laws.py --size small --out docs/studies/laws

Simulates campaigns of a rig with a constant viscous coefficient and one law of friction hidden
beside it at a stated strength (from FIRST_SEED on; all development used lower seeds), compares the
laws on each as the command does, and writes a line a campaign to OUT/laws-SIZE.K.jsonl and the page
to OUT.md. Each campaign is judged with all of its free runs, at three settings of the valve; those
of constant friction, memory and Coulomb friction once more with the middle setting alone.
Resumable: a campaign that has its line, in whatever part, is not run again. `--only` runs the
campaigns of some laws, `--three` leaves out the second judgement with one setting (a campaign run
so stays without).
`--page` writes the page alone. `--lookalikes` computes anew which laws leave the same trace
(OUT/lookalikes.json), from seeds of development.

The comparison sees the spec and the records. Truth goes from the generator to the line of the
campaign and nowhere else.
"""

import argparse
import dataclasses
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from discovery_scores import FLOOR
from laws_page import FLAT, LEAST, page
from rows import carry_out, lines_of

from rigid.friction.models import BRISTLES, COULOMB, MEMORY, SEAL, STRIBECK, VISCOUS
from rigid.generator import Conditions, campaign
from rigid.generator.campaign import drawn
from rigid.generator.conditions import secret
from rigid.generator.draw import stream
from rigid.generator.hidden import Hidden, hide
from rigid.generator.strength import TOLERANCE, Ground, ground

if TYPE_CHECKING:
    from rigid.friction.fits import FittedModels

FIRST_SEED = 951_000
"""Those from 950_000 on were looked at before slopes of steady rigs were derivatives."""
CLOCK = 1
LAWS = (VISCOUS, MEMORY, SEAL, COULOMB, STRIBECK, BRISTLES)
STRENGTHS = (8.0, 5.0)
SEEDS = {"small": 2, "issue": 25}
"""Campaigns of each law at each strength; constant friction, which has none, as many."""
ONE_SETTING = ("free-run-2",)
TRIALS = 8
JUDGED_TWICE = (VISCOUS, MEMORY, COULOMB)
"""Laws that one setting of the valve may hide behind one another."""
LOOKALIKE_SEEDS = (890_011, 890_012)


class Case(NamedTuple):
    """One campaign: the law that makes it, its strength (0: constant friction), its seed."""

    number: int
    law: str
    strength: float

    @property
    def seed(self) -> int:
        """One seed a campaign."""
        return FIRST_SEED + self.number


def cases(size: str) -> list[Case]:
    """List the campaigns of a size; laws and strengths take turns, so that any part is balanced."""
    turns = [(law, s) for _ in range(SEEDS[size]) for s in STRENGTHS for law in LAWS]
    return [
        Case(number, law, 0.0 if law == VISCOUS else strength)
        for number, (law, strength) in enumerate(turns)
    ]


class Made(NamedTuple):
    """A campaign in files: its spec, and what is hidden, with the strength each setting shows."""

    spec: Path
    hidden: Hidden | None
    strengths: dict[str, float]


def make(case: Case, folder: Path) -> Made:
    """Write a campaign of constant friction and the case's law; raises ValueError where the
    strength cannot be reached.
    """
    conditions = Conditions(clock=CLOCK, memory=False)
    hidden, secrets, strengths = None, None, {}
    if case.law != VISCOUS:
        truth = drawn(case.seed, conditions, field=False)
        on = ground(truth)
        cause = hide(case.law, stream(case.seed, "hidden", case.law), truth.runs)
        hidden, reached = scaled(on, cause, case.strength)
        strengths = {"three": reached, "one": left_of_it(on, hidden)}
        secrets = (secret(truth, hidden, reached),)
        conditions = dataclasses.replace(conditions, hidden=(hidden,))
    campaign(case.seed, folder, field=False, conditions=conditions, secrets=secrets)
    path = folder / "calibration.toml"
    text = path.read_text("ascii").replace(f'    "{MEMORY}",\n', "")
    path.write_text(text, "ascii")
    return Made(path, hidden, strengths)


def scaled(on: Ground, cause: Hidden, wanted: float) -> tuple[Hidden, float]:
    """The cause at a wanted strength, the constants' part taken as linear, and what it reached."""
    reached = on.strength(on.trace(cause))
    for _ in range(TRIALS):
        if abs(reached - wanted) < TOLERANCE * wanted:
            return cause, reached
        cause = cause.of(cause.amplitude * wanted / reached)
        reached = on.strength(on.trace(cause))
    raise ValueError(f"{cause.name} does not reach a strength of {wanted} in {TRIALS} trials")


def kept(kind: str, name: str) -> bool:
    """Whether a record stays where free runs of one setting are all there is."""
    return kind != "free-run" or name in ONE_SETTING


def left_of_it(on: Ground, cause: Hidden) -> float:
    """Strength of a cause in the records that stay where there is one setting of the valve."""
    names = {run.name for run in on.truth.runs if kept(run.kind, run.name)}
    seen = {key: np.ones_like(v) for key, v in on.base.items() if key.record in names}
    rows = on.layout.flat(seen) > 0.0
    design, trace = (on.shape @ on.price)[rows], on.trace(cause)[rows]
    shape, _ = np.linalg.qr(np.concatenate([design, np.eye(design.shape[1])]))
    absorbed = shape[: len(design)].T @ trace
    return float(np.sqrt(max(trace @ trace - absorbed @ absorbed, 0.0)))


def compared(spec_path: Path, law: str, seed: int, settings: str) -> dict:
    """Compare the laws as the command does; `settings`: "three", or "one" of the valve.

    `law`, the true one, is for `replicates` alone, once the comparison is done.

    The free runs of the other settings are masked, not taken out, so that programs are shared: a
    record of which nothing is read says nothing, and its flow keeps its prior.
    """
    from rigid.friction.comparison import compare
    from rigid.friction.fits import Asked, fit_laws
    from rigid.friction.models import Place, models, without_friction
    from rigid.likelihood.assemble import assemble
    from rigid.likelihood.listing import given_priors
    from rigid.records.read import read_records
    from rigid.report.laws.output import as_dict
    from rigid.spec import load_spec

    spec = load_spec(spec_path)
    problem = assemble(without_friction(spec, Place()), read_records(spec))
    if settings == "one":
        weights = {}
        for piece in problem.pieces:
            tracks = [problem.groups[piece.group].tracks[t] for t in piece.tracks]
            stays = np.array([kept(t.kind, t.name) for t in tracks])
            weights[piece.group, piece.quantity] = np.asarray(piece.weight) * stays
        problem = problem.with_weights(weights)
    began = time.monotonic(), time.process_time()
    given = given_priors(spec)
    asked = Asked(problem, models(spec, given, Place()), given, seed)
    fitted = fit_laws(asked, lambda _: None)
    found = compare(fitted, seed)
    made = told(as_dict(spec, found, None, seed))
    again = replicates(fitted, law, seed) if settings == "three" else None
    took = time.monotonic() - began[0], time.process_time() - began[1]
    made |= {"seconds": round(took[0], 1), "processor_s": round(took[1], 1)}
    return made | {"replicates": again}


def told(answer: dict) -> dict:
    """What the page rests on of laws.json, without differences by record and other priors."""
    of_a_law = (
        "law", "log_evidence", "log_evidence_error", "probability", "elpd_difference",
        "elpd_error", "elpd_expected", "tied", "short_of_top",
    )  # fmt: skip
    kept = ("verdict", "law", "first", "tied", "next_record", "gap", "usable", "seed")
    laws = [{k: law[k] for k in of_a_law if k in law} for law in answer["laws"]]
    return {k: answer[k] for k in kept if k in answer} | {"laws": laws}


def replicates(fitted: "FittedModels", law: str, seed: int) -> dict[str, float]:
    """Answers in campaigns that the true law's fit would make, by the parabola around each fit.

    Shares of them in which the law is first, first or tied, strictly first, and below 5 % in
    probability; mean -ln p of it as stated and flattened.
    """
    from rigid.friction.comparison import MOST_APART, amplitudes_of
    from rigid.localfit.leave_one_out import Judged, units
    from rigid.localfit.scatter import scattered

    judged = {x.name: Judged(fitted.fits[x.name], amplitudes_of(fitted.fits[x.name], x))
              for x in fitted.models}  # fmt: skip
    parts = units(fitted.fits[law], None)
    drawn = scattered(fitted.fits[law], judged, parts, seed + 77)
    names = list(drawn)
    logs = np.stack([drawn[n].evidence for n in names], axis=1)
    elpd = np.stack([drawn[n].density.sum(axis=1) for n in names], axis=1)
    chance = np.exp(logs - np.logaddexp.reduce(logs, axis=1)[:, None])
    first = chance.argmax(axis=1)
    errors = np.array([[np.std(elpd[:, i] - elpd[:, j]) for j in range(len(names))]
                       for i in range(len(names))])  # fmt: skip
    worse = elpd[np.arange(len(first)), first][:, None] - elpd
    tied = worse < np.minimum(errors[first], MOST_APART)
    tied[np.arange(len(first)), first] = False
    true = names.index(law)
    p = np.maximum(chance[:, true], FLOOR)
    return {
        "campaigns": len(first),
        "first": float(np.mean(first == true)),
        "first_or_tied": float(np.mean((first == true) | tied[:, true])),
        "strictly": float(np.mean((first == true) & ~tied.any(axis=1))),
        "below": float(np.mean(chance[:, true] < LEAST)),
        "score": float(np.mean(-np.log(p))),
        "flat": float(np.mean(-np.log(FLAT * p + (1.0 - FLAT) / len(names)))),
    }


def one_campaign(case: Case, twice: bool = True) -> dict:
    """Make a campaign, compare the laws on it, and put truth and answers into one row.

    - `twice`: compare them with one setting of the valve too, where the law is one of those.
    """
    from rigid.io.errors import RigidError

    row: dict = {"case": case._asdict(), "seed": case.seed, "answers": {}}
    with tempfile.TemporaryDirectory() as name:
        began = time.monotonic()
        try:
            made = make(case, Path(name))
        except ValueError as error:
            return row | {"says": str(error)}
        row["made_s"] = round(time.monotonic() - began, 1)
        row["strengths"] = made.strengths
        row["truth"] = json.loads((Path(name) / "truth.json").read_text("utf-8"))["hidden"]
        for settings in ("three", "one") if twice and case.law in JUDGED_TWICE else ("three",):
            try:
                row["answers"][settings] = compared(made.spec, case.law, case.seed, settings)
            except RigidError as error:
                row["says"] = str(error)
    return row


def lookalikes(path: Path) -> None:
    """Write the cosines between the traces of all laws beside constant friction, and the mean."""
    found = []
    names = [law for law in LAWS if law != VISCOUS]
    for seed in LOOKALIKE_SEEDS:
        truth = drawn(seed, Conditions(clock=CLOCK, memory=False), field=False)
        on = ground(truth)
        causes = [hide(name, stream(seed, "hidden", name), truth.runs) for name in names]
        found.append(on.cosines([on.trace(cause) for cause in causes]))
        sys.stderr.write(f"cosines of seed {seed}\n")
    stored = {"seeds": LOOKALIKE_SEEDS, "names": names}
    path.parent.mkdir(parents=True, exist_ok=True)
    cosines = np.mean(found, axis=0).round(3).tolist()
    path.write_text(json.dumps(stored | {"cosines": cosines}) + "\n", encoding="utf-8")


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", choices=tuple(SEEDS), default="small", help="how many campaigns")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/laws"), help="folder")
    parser.add_argument(
        "--only", nargs="+", choices=LAWS, default=LAWS, metavar="LAW", help="laws that make them"
    )
    parser.add_argument("--three", action="store_true", help="judge with three settings alone")
    parser.add_argument("--page", action="store_true", help="write the page from what there is")
    parser.add_argument("--lookalikes", action="store_true", help="compute which laws look alike")
    return parser.parse_args()


def main() -> int:
    args = options()
    if args.lookalikes:
        lookalikes(args.out / "lookalikes.json")
        return 0
    part, parts = (int(x) for x in args.part.split("/"))
    listed = cases(args.size)
    every = f"laws-{args.size}.*.jsonl"
    if not args.page:
        from rigid.io.runtime import prepare

        prepare()
        # Another cut into parts may have run it: no campaign is to count twice.
        done = {row["case"]["number"] for row in lines_of(sorted(args.out.glob(every)))}
        carry_out(
            args.out / f"laws-{args.size}.{part}.jsonl",
            [c for c in listed[part::parts] if c.law in args.only and c.number not in done],
            lambda case: one_campaign(case, not args.three),
            lambda row: {k: (v["verdict"], v["first"]) for k, v in row["answers"].items()},
        )
    rows = lines_of(sorted(args.out.glob(every)))
    stored = args.out / "lookalikes.json"
    known = json.loads(stored.read_text("utf-8")) if stored.exists() else {"names": []}
    args.out.with_suffix(".md").write_text(page(rows, known, len(listed), args.size), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
