"""Does discovery find what is missing, name it rightly, and keep quiet when nothing is?

    python tests/studies/discovery.py --size small --out docs/studies/discovery
    python tests/studies/discovery.py --size standard --part 0/2 --out docs/studies/discovery

Simulates the campaigns of discovery_cases.py with seeds of their own (from FIRST_SEED on; all
development used lower ones), runs discovery on each as the command does, and writes a line a
campaign to OUT/discovery-SIZE.K.jsonl and the page to OUT.md. Resumable: a campaign that has its
line is not run again. `--page` writes the page alone. `--lookalikes` computes anew which causes
leave the same trace (OUT/lookalikes.json), from seeds of development.

Discovery sees the spec and the records. Truth goes from the generator to the line of the campaign
and nowhere else.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from discovery_cases import CLOCK, FIRST_SEED, Case, Made, cases, make
from discovery_figures import figures
from discovery_page import answered, page
from rows import carry_out, lines_of, no_answer

if TYPE_CHECKING:
    from rigid.discovery.outcome import Outcome

ORDER = 2026
"""Seed of the order in which campaigns are run: the first of them are a fair sample of all."""
LOOKALIKE_SEEDS = (890_001, 890_002, 890_003)


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", choices=("small", "standard"), default="small")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/discovery"))
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--only", nargs="+", default=[], help="populations")
    parser.add_argument("--closure", action="store_true", help="gap closure on left-out blocks too")
    parser.add_argument("--page", action="store_true", help="write the page from what there is")
    parser.add_argument("--lookalikes", action="store_true")
    return parser.parse_args()


def discovered(made: Made, seed: int) -> tuple[dict, "Outcome | None"]:
    """Run discovery as the command does; gives discovery.json and what it was made of.

    What the command refuses or fails at has a `verdict` of its own here, and what it said.
    """
    from rigid.io.errors import RigidError
    from rigid.report.discovery.output import as_dict
    from rigid.study.study import load

    try:
        found = load(made.spec).discover(seed=seed, quiet=True)
    except (RigidError, ValueError) as error:  # the latter a defect: counted, and the run goes on
        return no_answer(error, made.spec.parent), None
    asked, outcome = found.question, found.outcome
    told = as_dict(asked.spec, outcome, None)
    return json.loads(json.dumps(told, allow_nan=False)) | {"notes": asked.notes}, outcome


def one_campaign(case: Case, with_closure: bool) -> dict:
    """Make a campaign, run discovery on it, and put truth and answer into one row."""
    from discovery_beside import beside
    from discovery_closure import closures

    row: dict = {"case": case._asdict(), "seed": case.seed}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        began = time.monotonic()
        try:
            made = make(case, folder)
        except ValueError as error:
            return row | {"answer": {"verdict": "unreachable", "steps": [], "says": str(error)}}
        row["made_s"] = round(time.monotonic() - began, 1)
        row["truth"] = json.loads((folder / "truth.json").read_text("utf-8"))["hidden"]
        began, busy = time.monotonic(), time.process_time()
        row["answer"], outcome = discovered(made, case.seed)
        row["discover_s"] = round(time.monotonic() - began, 1)
        row["core_s"] = round(time.process_time() - busy, 1)
        if outcome is None:
            return row
        row["beside"] = beside(outcome, made, case.seed)
        if with_closure and case.population == "single" and case.strength >= 8.0:
            row["closure"] = closures(outcome, made)
    return row


def lookalikes(path: Path) -> None:
    """Write the cosines between the traces of all causes, the mean over some campaigns."""
    from rigid.generator import Conditions
    from rigid.generator.campaign import drawn
    from rigid.generator.draw import stream
    from rigid.generator.hidden import HIDDEN, hide
    from rigid.generator.strength import ground

    found = []
    for seed in LOOKALIKE_SEEDS:
        truth = drawn(seed, Conditions(clock=CLOCK), field=False)
        on = ground(truth)
        causes = [hide(name, stream(seed, "hidden", name), truth.runs) for name in HIDDEN]
        traces = [on.trace(cause) for cause in causes]  # each about as strong as 8
        signs = np.array([getattr(cause, "sign", 1) for cause in causes])
        found.append(signs[:, None] * on.cosines(traces) * signs)
        sys.stderr.write(f"cosines of seed {seed}\n")
    either = [name for name, cause in HIDDEN.items() if "sign" in cause.__dataclass_fields__]
    cosines = np.mean(found, axis=0).round(3).tolist()
    stored = {"seeds": LOOKALIKE_SEEDS, "names": list(HIDDEN), "either_sign": either}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(stored | {"cosines": cosines}) + "\n", encoding="utf-8")


def main() -> int:
    args = options()
    if args.lookalikes:
        lookalikes(args.out / "lookalikes.json")
        return 0
    part, parts = (int(x) for x in args.part.split("/"))
    name = f"{args.out.name}-{args.size}"
    if args.first_seed != FIRST_SEED:
        name += f"-{args.first_seed}"
    every = cases(args.size, args.first_seed)
    if not args.page:
        from rigid.io.runtime import prepare

        prepare()
        order = np.random.default_rng(ORDER).permutation(len(every))
        listed = [every[i] for i in order]
        mine = [case for case in listed if not args.only or case.population in args.only]
        carry_out(
            args.out / f"{name}.{part}.jsonl",
            mine[part::parts],
            lambda case: one_campaign(case, args.closure),
            lambda row: (row["answer"]["verdict"], [s["effect"] for s in row["answer"]["steps"]]),
        )
    rows = lines_of(sorted(args.out.glob(f"{name}.*.jsonl")))
    known = json.loads((args.out / "lookalikes.json").read_text("utf-8"))
    planned = sum(not args.only or case.population in args.only for case in every)
    if args.first_seed == FIRST_SEED:
        pictures = [f"{args.out.name}/{path.name}" for path in figures(answered(rows), args.out)]
        text, path = page(rows, known, planned, args.size, pictures), args.out.with_suffix(".md")
    else:
        told = f"{args.size} --first-seed {args.first_seed}"
        told += f" --only {' '.join(args.only)}" if args.only else ""
        text = page(rows, known, planned, told)
        path = args.out.with_name(f"{args.out.name}-{args.first_seed}.md")
    path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
