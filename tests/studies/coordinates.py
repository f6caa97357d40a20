"""How much of a proposal's draws counts, without normal coordinates and with them.

    python tests/studies/coordinates.py --campaigns 0 1 2 5 7 8 9 10

Campaigns are those that `rigid validate` draws of the priors of fits/calibration.toml. Each is
fitted as a replicate is; then a law is fitted to the posterior in the coordinates with sums alone
and in normal coordinates, with symbols along directions down to two widths. Resumable; OUT.jsonl,
OUT.md.
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
NARROW = 0.003


class Case(NamedTuple):
    """One campaign."""

    number: int


def one_campaign(case: Case) -> dict:
    """Share of draws that count and Pareto shape, by coordinates; how far the sheet is bent."""
    from rigid.inference import normal_coordinates
    from rigid.inference.calibrate import propose
    from rigid.inference.coordinates import chart_of
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
    wide = normal_coordinates.WIDE
    charts = {"sums": chart_of(found.problem), "normal": normal_coordinates.normal_chart(found)}
    normal_coordinates.WIDE = NARROW
    charts["narrow"] = normal_coordinates.normal_chart(found)
    normal_coordinates.WIDE = wide
    row: dict = {"case": case._asdict()}
    for name, chart in charts.items():
        weights = propose(found, np.random.default_rng(3), chart).weights
        row[name] = round(weights.kish, 5), round(weights.pareto_k, 3)
    bend = charts["normal"].bend
    assert bend is not None
    row["bend"] = round(
        float(0.5 * np.linalg.norm(np.einsum("iik->ik", bend.symbols), axis=1).max()), 2
    )
    return row


def page(rows: list[dict]) -> str:
    """A row for each campaign."""
    out = [
        f"| campaign | bend [sds] | sums alone | normal coordinates | down to {NARROW:g} |",
        "|---|---|---|---|---|",
    ]
    for row in sorted(rows, key=lambda r: r["case"]["number"]):
        told = (
            f"{share:.2g}, {shape:.2f}"
            for share, shape in (row["sums"], row["normal"], row["narrow"])
        )
        out.append(f"| {row['case']['number']} | {row['bend']:.1f} | {' | '.join(told)} |")
    return "\n".join(out)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, nargs="+", default=list(range(11)))
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "studies" / "coordinates")
    args = parser.parse_args()
    from rigid.io.runtime import prepare

    prepare()
    path = args.out.with_suffix(".jsonl")
    carry_out(path, [Case(n) for n in args.campaigns], one_campaign, lambda row: row["normal"])
    rows = lines_of([path])
    code = ", ".join(sorted({row["commit"] for row in rows}))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    text = f"""# Normal coordinates

`python {" ".join(sys.argv)}`, code of {code}, {today}
(simulated, seed {SEED}).

Campaigns that `rigid validate` draws from the priors of `fits/calibration.toml`. "bend": by how
many of its standard deviations a narrow direction leaves the tangent within one of a wide one, at
most. Then the share of effective draws of the fitted proposal and the Pareto shape of its weights,
from 2,048 draws: with sums and ratios alone; in [normal coordinates](../inference.md); and with
symbols along narrower directions as well.

{page(rows)}
"""
    args.out.with_suffix(".md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
