"""Is the log-posterior at the truth as far below its best as it has to be?

    python tests/studies/drop.py --campaigns 100 --wide-friction --out docs/studies/coverage

Simulates campaigns as coverage.py does and fits each. Twice the drop of the log-posterior from its
best to the truth is chi squared with as many degrees of freedom as there are parameters, in every
coordinates that keep volumes and in which the posterior is Gaussian: no law around the best fit, no
chain and no choice of a quantity comes into it. A likelihood that takes records for more than they
are makes the mean greater. Beside it the
distance of the truth from the best fit in the Gaussian laws of z and of the chart's coordinates,
which has the same law where these fit. Resumable; OUT/drop[-wide].jsonl, OUT/drop[-wide].md.

`--halve-noise` holds the noise at half of what the search finds, to show that the check can fail.
"""

import argparse
import datetime
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from coverage import CLOCK, FIRST_SEED, REFUSED, halved, standard
from rows import carry_out, lines_of
from scipy.stats import chi2


class Case(NamedTuple):
    """One campaign."""

    number: int
    wide: bool
    halve_noise: bool


def one_campaign(case: Case) -> dict:
    """Fit a campaign and measure how far the truth is from the best fit."""
    from rigid.generator.campaign import Conditions, campaign
    from rigid.inference.coordinates import chart_of
    from rigid.inference.search import search_from
    from rigid.io.errors import InputError
    from rigid.likelihood.assemble import assemble
    from rigid.likelihood.problem import log_density
    from rigid.records.read import read_records
    from rigid.spec import load_spec

    row: dict = {"case": case._asdict()}
    with tempfile.TemporaryDirectory() as folder:
        conditions = Conditions(clock=CLOCK, wide_friction=case.wide)
        truth = campaign(FIRST_SEED + case.number, Path(folder), field=False, conditions=conditions)
        spec = load_spec(Path(folder) / "calibration.toml")
        try:
            problem = assemble(spec, read_records(spec))
        except InputError:
            return row | {"drop": REFUSED}
    known = truth.parameters()
    found = search_from(problem, standard(problem, known)[None])
    if case.halve_noise:
        less = halved(found)
        found = search_from(less, standard(less, known)[None])
    best = found.optima[0]
    z = standard(found.problem, known)
    top, there = log_density(found.problem, np.stack([best.z, z]))
    chart = chart_of(found.problem)
    straight = chart.straightened(best)
    return row | {
        "size": len(z),
        "drop": round(2.0 * float(top - there), 3),
        "in_z": round(_distance(z - best.z, best.covariance), 3),
        "in_u": round(_distance(chart.straight(z) - straight.z, straight.covariance), 3),
    }


def _distance(away: np.ndarray, covariance: np.ndarray) -> float:
    return float(away @ np.linalg.solve(covariance, away))


def page(rows: list[dict]) -> str:
    """The table: mean, and how many campaigns lie beyond quantiles of chi squared."""
    kept = [r for r in rows if r["drop"] != REFUSED]
    out = ["| | mean, over the parameters' number | expected | above the 95 % quantile | largest |",
           "|---|---|---|---|---|"]  # fmt: skip
    names = {"drop": "twice the drop of the log-posterior", "in_z": "distance, Gaussian law in z",
             "in_u": "distance, Gaussian law in the chart's coordinates"}  # fmt: skip
    size = np.array([r["size"] for r in kept], dtype=float)
    error = np.sqrt(2.0 / size.mean() / len(kept))
    for key, label in names.items():
        values = np.array([r[key] for r in kept])
        above = (values > chi2.ppf(0.95, size)).mean()
        out.append(
            f"| {label} | {(values / size).mean():.3g} | 1 +- {error:.2g} | {100 * above:.0f} % "
            f"| {values.max():.4g} |"
        )
    refused = len(rows) - len(kept)
    out += [
        "",
        f"{len(kept)} campaigns, {size.mean():.0f} parameters; {refused} more were refused.",
    ]
    return "\n".join(out)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--wide-friction", action="store_true", help="friction from the prior")
    parser.add_argument("--halve-noise", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/coverage"))
    args = parser.parse_args()
    from rigid.io.runtime import prepare

    prepare()
    name = "drop" + args.wide_friction * "-wide" + args.halve_noise * "-halved"
    path = args.out / f"{name}.jsonl"
    cases = [Case(n, args.wide_friction, args.halve_noise) for n in range(args.campaigns)]
    carry_out(path, cases, one_campaign, lambda row: row["drop"])
    rows = lines_of([path])
    code = ", ".join(sorted({r["commit"] for r in rows}))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    head = f"`python {' '.join(sys.argv)}`, code of {code}, {today} (simulated).\n\n"
    (args.out / f"{name}.md").write_text(head + page(rows) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
