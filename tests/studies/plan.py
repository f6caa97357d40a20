"""Does the next record tell what it was expected to, and more than one taken by chance?

    python tests/studies/plan.py --campaigns 50 --seed 48271 --part 0/2

Campaigns are those that `rigid validate` draws of the priors of fits/calibration.toml. Each is
fitted from its truth on, and records that could be taken are ranked for |mu| at 80 Hz and k_LC. The
first and one drawn by chance are then taken: simulated at the truth, with a preload and an instant
of their own, put beside the campaign and fitted with it. Rows: the
standard deviations before and after, and the factors that were expected. Resumable; OUT.K.jsonl;
OUT.md from all parts.
"""

import argparse
import datetime
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rows import carry_out, lines_of

ROOT = Path(__file__).parents[2]
FARTHEST = 3.0
QUANTITIES = ("abs_mu[80 Hz]", "k_LC")
NEXT = "next"


class Case(NamedTuple):
    """One campaign; `alone`: without the record that is drawn by chance."""

    number: int
    seed: int
    alone: bool = False


def one_campaign(case: Case) -> dict:
    """What was expected of two records, and what they told."""
    from rigid.inference.calibrate import propose
    from rigid.inference.search import search_from
    from rigid.io.errors import InputError
    from rigid.planning.change import stated
    from rigid.planning.quantity import quantity_of
    from rigid.planning.ranking import Fitted, rank
    from rigid.spec import load_spec
    from rigid.validation.campaign import draw, read_base
    from rigid.validation.design import Design

    spec, rng = (
        load_spec(ROOT / "fits" / "calibration.toml"),
        np.random.default_rng([case.seed, case.number]),
    )
    made = draw(read_base(spec, {}), Design(case.seed), case.number)
    found = search_from(made.problem, np.clip(made.z, -FARTHEST, FARTHEST)[None])
    known = propose(found, rng)
    asked = {name: quantity_of(found.problem, name, "study") for name in QUANTITIES}
    ranking = rank(Fitted(spec, made.records, known), asked, stated(spec, found.problem), case.seed)
    before = _known(found, asked)
    row: dict[str, Any] = {"case": case._asdict(), "before": before._asdict(), "taken": {}}
    by_chance = int(rng.integers(1, len(ranking.possible)))
    listed = {"first": ranking.possible[0], "by chance": ranking.possible[by_chance]}
    for name, one in list(listed.items())[: 1 if case.alone else 2]:
        try:
            after = _known(_taken(spec, made, one.change, case.seed, rng), asked)
        except InputError as refusal:  # a sensor at the end of its range at this truth, mostly
            row["taken"][name] = {
                "record": one.change.says,
                "refused": str(refusal).replace(f"{made.records[0].path.parent}/", ""),
            }
            continue
        row["taken"][name] = {
            "record": one.change.says,
            "expected": [round(one.expected(q), 4) for q in range(len(QUANTITIES))],
            "within": [np.round(one.within(q), 4).tolist() for q in range(len(QUANTITIES))],
            "found": [round(a / b, 4) for a, b in zip(after.sds, before.sds, strict=True)],
            "moved": [round(a / b, 4) for a, b in zip(after.values, before.values, strict=True)],
        }
    return row


class Known(NamedTuple):
    """Quantities at the best fit, and their standard deviations by the law around it."""

    values: list[float]
    sds: list[float]


def _known(found: Any, asked: dict) -> Known:
    """What a fit knows of the quantities."""
    from rigid.inference.newton import is_noise
    from rigid.planning.quantity import quantity_of, slope

    best, free = found.optima[0], ~is_noise(found.problem)
    listed = [quantity_of(found.problem, name, "study").values for name in asked]
    slopes = [slope(values, best.z)[free] for values in listed]
    covariance = best.covariance[np.ix_(free, free)]
    return Known(
        [float(values(best.z[None])[0]) for values in listed],
        [float(np.sqrt(g @ covariance @ g)) for g in slopes],
    )


def _taken(spec: Any, made: Any, change: Any, seed: int, rng: np.random.Generator) -> Any:
    """Fit the campaign together with a record that was taken."""
    import dataclasses

    from rigid.inference.search import search_from
    from rigid.likelihood.assemble import assemble
    from rigid.planning.change import as_taken, placed
    from rigid.validation.campaign import Base, measured
    from rigid.validation.design import Design

    more = as_taken(spec, made.records, change, NEXT)
    longer = spec.model_copy(update={"records": spec.records + more.specs})
    base = Base(longer, made.records + more.records, assemble(longer, made.records + more.records))
    truth = rng.standard_normal(base.problem.parameters.size)
    old = dict(zip(made.problem.parameters.labels, made.z, strict=True))
    like = {
        p.label: p.label.replace(f"[{NEXT},", f"[{change.like},")
        for p in base.problem.parameters.sampled
    }
    new = {  # a preload and an instant are new; a flow fraction is that of the record it is like
        p.label for p in base.problem.parameters.sampled
        if p.record == NEXT and p.base in ("preload", "release_time")
    }  # fmt: skip
    for i, p in enumerate(base.problem.parameters.sampled):
        if p.label not in new:
            truth[i] = old[like[p.label]]
    own = dataclasses.replace(change, like=NEXT)
    truth = placed(base.problem, base.problem, (own,), truth)
    records, _ = measured(base, Design(seed), truth, made.sensors, rng)
    both = made.records + tuple(r for r in records if r.name == NEXT)
    problem = assemble(longer, both)
    return search_from(problem, np.clip(truth, -FARTHEST, FARTHEST)[None])


def page(rows: list[dict]) -> str:
    """What was expected and what was found, by record and quantity."""
    out = [
        "| record | quantity | campaigns | factor expected, median | found, median "
        "| ln found - ln expected: mean ± its error, median, sd | the same of sd over value "
        "| found within 5 to 95 % of the expected |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in ("first", "by chance"):
        for q, quantity in enumerate(QUANTITIES):
            told = [r["taken"][name] for r in rows if "found" in r["taken"].get(name, {})]
            if not told:
                continue
            expected = np.array([one["expected"][q] for one in told])
            found = np.array([one["found"][q] for one in told])
            moved = np.array([one["moved"][q] for one in told])
            low, high = np.array([one["within"][q] for one in told]).T
            inside = np.mean((found >= low) & (found <= high))
            out.append(
                f"| {name} | {quantity.replace('abs_mu', 'abs mu')} | {len(told)} "
                f"| {np.median(expected):.3f} | {np.median(found):.3f} "
                f"| {_off(np.log(found / expected))} | {_off(np.log(found / moved / expected))} "
                f"| {100 * inside:.0f} % |"
            )
    both = [r["taken"] for r in rows if "by chance" in r["taken"]]
    both = [taken for taken in both if all("found" in one for one in taken.values())]
    better = sum(one["first"]["found"][0] < one["by chance"]["found"][0] for one in both)
    refused = {
        name: sum("refused" in r["taken"].get(name, {}) for r in rows)
        for name in ("first", "by chance")
    }
    out += ["", f"The first told more of {QUANTITIES[0].replace('abs_mu', 'abs mu')} than the one "
            f"by chance in {better} of {len(both)} campaigns. The readers refused the first in "
            f"{refused['first']} campaigns and the one by chance in {refused['by chance']}, mostly "
            "for a sensor at the end of its range."]  # fmt: skip
    return "\n".join(out)


def _off(off: np.ndarray) -> str:
    spread = off.std(ddof=1) if len(off) > 1 else np.nan
    error = spread / np.sqrt(len(off))
    return f"{off.mean():+.3f} ± {error:.3f}, {np.median(off):+.3f}, {spread:.3f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=50)
    parser.add_argument("--seed", type=int, default=48271)
    parser.add_argument("--alone", action="store_true", help="take the first record alone")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "studies" / "plan")
    args = parser.parse_args()
    from rigid.io.runtime import prepare

    prepare()
    part, parts = map(int, args.part.split("/"))
    path = args.out.with_suffix(f".{part}.jsonl")
    cases = [Case(n, args.seed, args.alone) for n in range(args.campaigns) if n % parts == part]
    carry_out(path, cases, one_campaign, lambda row: row["taken"])
    rows = lines_of(sorted(args.out.parent.glob(f"{args.out.name}.*.jsonl")))
    code = ", ".join(sorted({row["commit"] for row in rows}))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    about = (__doc__ or "").split("\n\n")[2].split(" Rows:")[0].replace("\n", " ")
    text = f"""# The next record: expected and found

`python {" ".join(sys.argv)}`, code of {code}, {today} (simulated, seed {args.seed}).

{about}
{len(rows)} campaigns; a factor is that of the standard deviation.

{page(rows)}
"""
    args.out.with_suffix(".md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
