"""Share of a proposal's draws that counts, in coordinates along the posterior's ridge and without.

    python tests/studies/coordinates.py --campaigns 0 1 2 5 7 8 9 10

Campaigns are those that `rigid validate` draws of the priors of fits/calibration.toml. Each is
fitted as a replicate is; then a law is fitted to the posterior in the coordinates with sums alone
and in those along the ridge. Resumable; OUT.jsonl, OUT.md.
"""

import argparse
import datetime
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rows import carry_out, lines_of

ROOT = Path(__file__).parents[2]
SEED, PRIOR_STARTS, FARTHEST = 9001, 2, 3.0


class Case(NamedTuple):
    """One campaign."""

    number: int


def one_campaign(case: Case) -> dict:
    """Share of draws that count and Pareto shape, by coordinates; how many directions are wide."""
    from rigid.inference.calibrate import propose
    from rigid.inference.coordinates import chart_of
    from rigid.inference.ridge import Ridge, ridge_of
    from rigid.inference.search import search_from
    from rigid.spec import load_spec
    from rigid.validation.campaign import draw, read_base
    from rigid.validation.design import Design

    spec = load_spec(ROOT / "fits" / "calibration.toml")
    made = draw(read_base(spec, {}), Design(SEED), case.number)
    rng = np.random.default_rng([SEED, case.number, 1])
    near = np.clip(made.z, -FARTHEST, FARTHEST)
    found = search_from(
        made.problem, np.concatenate([near[None], rng.standard_normal((PRIOR_STARTS, len(near)))])
    )
    ridge, sums = ridge_of(found), chart_of(found.problem)
    row: dict = {"case": case._asdict()}
    for name, one in (("sums", Ridge(sums, sums, None)), ("ridge", ridge)):
        weights = propose(found, np.random.default_rng(3), one).weights
        row[name] = round(weights.kish, 5), round(weights.pareto_k, 3)
    bends = ridge.chart.bends
    row["wide"] = bends[-1].wide if bends else 0
    return row


def page(rows: list[dict]) -> str:
    """A row for each campaign."""
    out = ["| campaign | wide directions | sums alone | along the ridge |", "|---|---|---|---|"]
    for row in sorted(rows, key=lambda r: r["case"]["number"]):
        told = (f"{share:.2g}, {shape:.2f}" for share, shape in (row["sums"], row["ridge"]))
        out.append(f"| {row['case']['number']} | {row['wide']} | {' | '.join(told)} |")
    return "\n".join(out)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, nargs="+", default=list(range(11)))
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "studies" / "coordinates")
    args = parser.parse_args()
    from rigid.io.runtime import prepare

    prepare()
    path = args.out.with_suffix(".jsonl")
    carry_out(path, [Case(n) for n in args.campaigns], one_campaign, lambda row: row["ridge"])
    rows = lines_of([path])
    code = ", ".join(sorted({row["commit"] for row in rows}))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    text = f"""# Coordinates along the ridge

`python {" ".join(sys.argv)}`, code of {code}, {today}
(simulated, seed {SEED}).

Campaigns that `rigid validate` draws from the priors of `fits/calibration.toml`. The share of
effective draws of the fitted proposal and the Pareto shape of its weights, from 2,048 draws: with
sums and ratios alone, and in [coordinates along the ridge](../inference.md).

{page(rows)}
"""
    args.out.with_suffix(".md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
