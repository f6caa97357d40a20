"""Do the intervals of a calibration cover the truth as often as they say?

    python tests/studies/coverage.py --campaigns 100 --out docs/studies/coverage

Simulates campaigns with seeds of their own (from FIRST_SEED on; the shipped campaign and all
development used others), fits each as `rigid.fit` does and counts how often the 50 % and 90 %
intervals of k_LC, every kappa, |mu| at 0 and 80 Hz, and both parts of mu at 0.1 to 100 Hz hold the
truth. Resumable: a campaign that stands in the file of rows is not run again. `--halve-noise` fits
with half the noise in the likelihood, to show that the check can fail; `--noise-correlation 0.8`
colours the noise; `--wide-friction` draws the friction from the fit's own priors.

The posterior is that of the command, from fewer starts; it is summed over weighted draws of the
law around its modes (importance.py), until they are worth 500 independent ones. Where
that law does not fit (Pareto shape above 0.7) or with `--chain`, the command's sampler draws.
Beside it stand the rank in draws of the law around the best fit that is Gaussian in the chart's
coordinates and, as `delta`, in the Gaussian law of each quantity's logarithm itself, to first
order. `--gaussian` gives these alone.
`--from-truth` begins the search at what made the campaign, where draws of the prior would take a
hundred slow steps to the same optimum; that they do is for `--first` and `--campaigns` to show on
some.
"""

import argparse
import csv
import dataclasses
import datetime
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from rows import commit

if TYPE_CHECKING:
    from importance import Drawn

FIRST_SEED = 500_000
CLOCK = 1
STARTS = 3
REFUSED = "refused"
"""Stands for the quantities of a campaign that the readers refuse (a saturated sensor, say)."""
STEP = 0.05
"""Of differences along the axes of a Gaussian law, in its sds."""
HERTZ = (0.1, 1.0, 10.0, 100.0)
"""Frequencies at which the parts of mu(omega) are held against the truth."""
COLUMNS = ("seed", "quantity", "truth", "rank", "converged", "gap", "modes", "gaussian",
           "delta")  # fmt: skip


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--out", type=Path, default=Path("docs/studies/coverage"))
    parser.add_argument("--halve-noise", action="store_true")
    parser.add_argument("--noise-correlation", type=float, default=0.0)
    parser.add_argument("--chain", action="store_true", help="draw by emcee, four times slower")
    parser.add_argument("--gaussian", action="store_true", help="that of the best fit alone")
    parser.add_argument("--wide-friction", action="store_true", help="friction from the prior")
    parser.add_argument("--starts", type=int, default=STARTS, help="of the search")
    parser.add_argument("--from-truth", action="store_true", help="one start, at the truth")
    parser.add_argument("--first", type=int, default=0, help="campaign to begin with")
    parser.add_argument("--table", action="store_true", help="of all on file, fitting none")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    return parser.parse_args()


def rows_of(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def by_chain(known, seed: int) -> "Drawn":
    """Draws of the command's sampler."""
    import jax.numpy as jnp
    import numpy as np
    from importance import ESS, Drawn

    from rigid.inference.sample import Settings, sample
    from rigid.likelihood.problem import log_posterior, walkers

    problem, chart = known.found.problem, known.chart
    settings = Settings(
        ensembles=2, walkers=walkers(problem), block=50, max_steps=1000, r_hat=1.03,
        ess=ESS, seed=seed,
    )  # fmt: skip
    density = chart.density(lambda z: np.asarray(log_posterior(problem, jnp.asarray(z))))
    draws = sample(density, known.law, settings)
    z = chart.standard(draws.z.reshape(-1, draws.z.shape[-1]))
    return Drawn(z, np.ones(len(z)), draws.converged)


def weighted_rank(values, weights, truth: float) -> float:
    """Posterior probability below the truth."""
    return float(weights[values < truth].sum() / weights.sum())


def one_campaign(seed: int, args: argparse.Namespace) -> list[dict]:
    import numpy as np
    from importance import BATCH, Drawn, weighted

    from rigid.generator.campaign import Conditions, campaign
    from rigid.inference.calibrate import propose
    from rigid.inference.coordinates import chart_of
    from rigid.inference.derived import channels, overall_gap
    from rigid.inference.search import search, search_from
    from rigid.io.errors import InputError
    from rigid.likelihood.assemble import assemble
    from rigid.records.read import read_records
    from rigid.spec import load_spec

    with tempfile.TemporaryDirectory() as folder:
        conditions = Conditions(
            args.noise_correlation, clock=CLOCK, wide_friction=args.wide_friction
        )
        truth = campaign(seed, Path(folder), field=False, conditions=conditions)
        spec = load_spec(Path(folder) / "calibration.toml")
        try:
            records = read_records(spec)
        except InputError as refusal:
            sys.stderr.write(f"campaign of seed {seed} is refused: {refusal}\n")
            return [dict.fromkeys(COLUMNS, "") | {"seed": seed, "quantity": REFUSED}]
        problem = assemble(spec, records)
    known, rng = truth.parameters(), np.random.default_rng([seed, 1])
    if args.from_truth:
        found = search_from(problem, standard(problem, known)[None])
    else:
        found = search(problem, args.starts, seed)
    if args.halve_noise:
        found = search(halved(found), args.starts, seed)
    chart = chart_of(found.problem)
    u = gaussian(chart.straightened(found.optima[0]), rng, BATCH)
    gauss = Drawn(chart.standard(u), np.ones(BATCH), True)
    drawn = gauss
    if not args.gaussian:
        proposed = propose(found, rng)
        drawn = weighted(proposed, rng)
        if args.chain or not drawn.good:
            drawn = by_chain(proposed, seed)
    ranks = ranks_of(found.problem, drawn, known)
    beside = ranks_of(found.problem, gauss, known)
    delta = first_order(found.problem, found.optima[0], known)
    gap = overall_gap(channels(found, found.optima[0].z[None], seed))
    return [
        {
            "seed": seed, "quantity": name, "truth": f"{true:.8g}", "rank": f"{rank:.5f}",
            "converged": drawn.good, "gap": f"{gap:.4f}", "modes": len(found.optima),
            "gaussian": f"{beside[name][1]:.5f}", "delta": f"{delta[name]:.5f}",
        }
        for name, (true, rank) in ranks.items()
    ]  # fmt: skip


def standard(problem, known: dict[str, float]):
    """The vector z (size,) at known values."""
    import numpy as np

    grid = np.linspace(-6.0, 6.0, 2401)  # far finer than a posterior's width, which is all it takes
    z = []
    for parameter in problem.parameters.sampled:
        values = np.asarray(parameter.prior.from_standard(grid))
        order = np.argsort(values)
        z.append(
            np.interp(known.get(parameter.label, float(values[1200])), values[order], grid[order])
        )
    return np.array(z)


def gaussian(optimum, rng, count):
    """Draws (count, size) of the Gaussian law around an optimum."""
    return rng.multivariate_normal(optimum.z, optimum.covariance, size=count, method="cholesky")


def ranks_of(problem, drawn: "Drawn", known: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Truth of every quantity, and the posterior probability below it."""
    return {
        name: (true, weighted_rank(v, drawn.weight, true))
        for name, (v, true) in quantities(problem, drawn.z, known).items()
    }


def first_order(problem, optimum, known: dict[str, float]) -> dict[str, float]:
    """Probability below the truth in the Gaussian law of each quantity's logarithm."""
    import numpy as np
    from scipy.stats import norm

    axes = STEP * np.linalg.cholesky(optimum.covariance).T
    around = np.concatenate([optimum.z[None], optimum.z + axes, optimum.z - axes])
    ranks = {}
    for name, (values, true) in quantities(problem, around, known).items():
        best, up, down = np.split(np.log(values), [1, 1 + len(axes)])
        sd = np.linalg.norm(up - down) / (2.0 * STEP)
        ranks[name] = float(norm.cdf((np.log(true) - best[0]) / sd))
    return ranks


def quantities(problem, z, known: dict[str, float]) -> dict:
    """Every quantity at points z (n, size): its values (n,) and its truth."""
    import numpy as np

    from rigid.inference.derived import frictions, values_of
    from rigid.inference.friction_curve import FREQUENCIES

    values = values_of(problem, z)
    curve = frictions(problem, values)[""]
    names = ["k_LC", "k_frame", *(k for k in values if k.startswith("kappa["))]
    found = {name: (values[name], known[name]) for name in names}
    for hertz in (0.01, 80.0, *HERTZ):
        at = int(np.argmin(np.abs(FREQUENCIES - hertz)))
        omega = 2 * np.pi * FREQUENCIES[at]
        true = complex_friction(known, omega)
        if hertz in HERTZ:
            found[f"Re mu({hertz:g} Hz)"] = (curve.dissipative[:, at], true.real)
            found[f"-omega Im mu({hertz:g} Hz)"] = (curve.storage[:, at], -omega * true.imag)
        else:
            found[f"|mu({hertz:g} Hz)|"] = (curve.magnitude[:, at], abs(true))
    return found


def complex_friction(known: dict[str, float], omega: float) -> complex:
    """The generator's mu(omega), from its truth."""
    branches = sum(
        known[f"mu_branch[{i}]"] / (1 + 1j * omega * known[f"tau_branch[{i}]"]) for i in (1, 2)
    )
    return known["mu"] + branches


def halved(found):
    """The problem of a search with noise levels known to be half of what the search found."""
    import equinox as eqx
    import jax.numpy as jnp

    from rigid.likelihood.parameters import Parameters
    from rigid.likelihood.priors import Normal

    problem = found.problem
    parameters, best = problem.parameters, found.optima[0].z
    level = parameters.values(jnp.asarray(best[None]))
    known = tuple(
        dataclasses.replace(p, prior=Normal(0.5 * level[p.label][0], jnp.asarray(0.0)))
        for p in parameters.sampled
        if p.base == "noise"
    )
    kept = tuple(p for p in parameters.sampled if p.base != "noise")
    new = Parameters(kept, parameters.known + known)
    return eqx.tree_at(lambda q: q.parameters, problem, new)


def verdict(rows: list[dict[str, str]], column: str = "rank") -> str:
    """Table of coverage by quantity, campaigns as the unit, with the binomial band."""
    from scipy.stats import binom

    names = {"k_LC": "k_LC", "k_frame": "k_frame", "kappa": "kappa (every record)",
             "|mu(0.01 Hz)|": "abs mu at 0 Hz", "|mu(80 Hz)|": "abs mu at 80 Hz"}  # fmt: skip
    for hertz in HERTZ:
        names[f"Re mu({hertz:g} Hz)"] = f"dissipative part at {hertz:g} Hz"
        names[f"-omega Im mu({hertz:g} Hz)"] = f"storage part at {hertz:g} Hz"
    refused = sum(row["quantity"] == REFUSED for row in rows)
    lines = ["| quantity | campaigns | 50 % interval covers | band | 90 % interval covers | band |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for key, label in names.items():
        by_campaign: dict[str, list[float]] = {}
        for row in rows:
            if row["quantity"].split("[")[0] == key:
                by_campaign.setdefault(row["seed"], []).append(float(row[column]))
        n = len(by_campaign)
        if n == 0:
            continue
        cells = [label, str(n)]
        for level in (0.5, 0.9):
            low, high = 0.5 - level / 2, 0.5 + level / 2
            shares = [
                sum(low <= r <= high for r in ranks) / len(ranks) for ranks in by_campaign.values()
            ]
            band = binom.interval(0.95, n, level)
            cells += [f"{100 * sum(shares) / n:.1f} %",
                      f"{100 * band[0] / n:.0f}-{100 * band[1] / n:.0f} %"]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", f"Campaigns that the readers refused, and that are not counted: {refused}."]
    return "\n".join(lines)


PLAIN = ("coverage", "coverage-gaussian", "coverage-fitted")
"""Files of rows in which nothing was broken on purpose: weighted draws of the law around the best
fit, that law itself, and weighted draws of one fitted to them."""


def table(folder: Path) -> str:
    """Table of all campaigns on file, each seed once, however its posterior was summed."""
    return verdict(
        [row for name in PLAIN for p in folder.glob(f"{name}.?.csv") for row in rows_of(p)]
    )


def main() -> int:
    args = options()
    if args.table:
        sys.stdout.write(table(args.out) + "\n")
        return 0
    part, parts = (int(x) for x in args.part.split("/"))
    from rigid.io.runtime import prepare

    prepare()
    name = "halved" if args.halve_noise else "coverage"
    name += "-gaussian" if args.gaussian else "-fitted"
    if args.wide_friction:
        name += "-wide"
    if args.from_truth:
        name += "-from-truth"
    if args.noise_correlation:
        name += f"-correlation-{args.noise_correlation:g}"
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / f"{name}.{part}.csv"
    begun = rows_of(path)
    if begun and tuple(begun[0]) != COLUMNS:
        sys.stderr.write(f"{path} is of an older study with other columns; give another --out\n")
        return 2
    done = {row["seed"] for row in begun}
    for number in range(args.first + part, args.campaigns, parts):
        seed = FIRST_SEED + number
        if str(seed) in done:
            continue
        rows = one_campaign(seed, args)
        fresh = not path.exists()
        with path.open("a", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            if fresh:
                writer.writeheader()
            writer.writerows(rows)
        sys.stderr.write(f"campaign {number + 1} of {args.campaigns}: {rows[0]}\n")
    rows = [row for p in sorted(args.out.glob(f"{name}.?.csv")) for row in rows_of(p)]
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    head = f"`python {' '.join(sys.argv)}`, commit {commit()}, {today}\n\n"
    text = f"{head}{verdict(rows)}\n\nTo first order:\n\n{verdict(rows, 'delta')}\n"
    (args.out / f"{name}.md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
