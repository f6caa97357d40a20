"""Do the intervals of a calibration cover the truth as often as they say?

    python tests/studies/coverage.py --campaigns 100 --out docs/studies/coverage

Simulates campaigns with seeds of their own (from FIRST_SEED on; the shipped campaign and all
development used others), fits each as `rigid.fit` does and counts how often the 50 % and 90 %
intervals of k_LC, every kappa and |mu| at 0 and 80 Hz hold the truth. Resumable: a campaign that
stands in the file of rows is not run again. `--halve-noise` fits with half the noise in the
likelihood, to show that the check can fail; `--noise-correlation 0.8` colours the noise.

The posterior is that of the command, from fewer starts; it is summed over weighted draws of the
law around its modes (as the command weighs modes), until they are worth ESS independent ones. Where
that law does not fit (Pareto shape above 0.7) or with `--chain`, the command's sampler draws.
"""

import argparse
import csv
import datetime
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np

FIRST_SEED = 500_000
CLOCK = 1
STARTS = 3
ESS = 500.0
BATCH, MOST_DRAWS = 2048, 16_384
DOF = 32.0
REFUSED = "refused"
"""Stands for the quantities of a campaign that the readers refuse (a saturated sensor, say)."""
COLUMNS = ("seed", "quantity", "truth", "rank", "converged", "gap", "modes")


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--out", type=Path, default=Path("docs/studies/coverage"))
    parser.add_argument("--halve-noise", action="store_true")
    parser.add_argument("--noise-correlation", type=float, default=0.0)
    parser.add_argument("--chain", action="store_true", help="draw by emcee, four times slower")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    return parser.parse_args()


def rows_of(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class Drawn(NamedTuple):
    """Draws of the posterior (n, size), their weights (n,), and whether they can be trusted."""

    z: "np.ndarray"
    weight: "np.ndarray"
    good: bool


def by_weights(problem, modes, rng) -> Drawn:
    """Weighted draws of the law over the modes."""
    import numpy as np

    from rigid.problem import log_density
    from rigid.proposal import MixtureProposal, pareto_shape

    law = MixtureProposal(modes, np.ones(len(modes)) / len(modes), DOF)
    draws, logs = [], []
    while True:
        draws.append(law.sample(rng, BATCH))
        logs.append(log_density(problem, draws[-1]) - law.log_density(draws[-1]))
        log_weight = np.concatenate(logs)
        weight = np.exp(log_weight - log_weight.max())
        enough = weight.sum() ** 2 / (weight**2).sum() >= ESS
        if enough or len(weight) >= MOST_DRAWS:
            return Drawn(np.concatenate(draws), weight, enough and pareto_shape(weight) < 0.7)


def by_chain(problem, proposal, seed: int) -> Drawn:
    """Draws of the command's sampler."""
    import jax.numpy as jnp
    import numpy as np

    from rigid.problem import log_posterior, walkers
    from rigid.sample import Settings, sample

    settings = Settings(
        ensembles=2, walkers=walkers(problem), block=50, max_steps=1000, r_hat=1.03,
        ess=ESS, seed=seed, names=problem.parameters.labels,
    )  # fmt: skip
    draws = sample(lambda z: np.asarray(log_posterior(problem, jnp.asarray(z))), proposal, settings)
    z = draws.z.reshape(-1, draws.z.shape[-1])
    return Drawn(z, np.ones(len(z)), draws.converged)


def weighted_rank(values, weights, truth: float) -> float:
    """Posterior probability below the truth."""
    return float(weights[values < truth].sum() / weights.sum())


def one_campaign(seed: int, args: argparse.Namespace) -> list[dict]:
    import numpy as np

    from rigid.assemble import assemble
    from rigid.calibrate import mode_of, propose
    from rigid.errors import InputError
    from rigid.friction import FREQUENCIES
    from rigid.generator.campaign import Conditions, campaign
    from rigid.outcome import channels, frictions, overall_gap, values_of
    from rigid.records.read import read_records
    from rigid.search import search
    from rigid.spec import load_spec

    with tempfile.TemporaryDirectory() as folder:
        truth = campaign(
            seed,
            Path(folder),
            field=False,
            conditions=Conditions(args.noise_correlation, clock=CLOCK),
        )
        spec = load_spec(Path(folder) / "calibration.toml")
        try:
            records = read_records(spec)
        except InputError as refusal:
            sys.stderr.write(f"campaign of seed {seed} is refused: {refusal}\n")
            return [dict.fromkeys(COLUMNS, "") | {"seed": seed, "quantity": REFUSED}]
        problem = assemble(spec, records)
    found = search(problem, STARTS, seed)
    if args.halve_noise:
        found = search(halved(found), STARTS, seed)
    rng = np.random.default_rng([seed, 1])
    drawn = by_weights(found.problem, tuple(mode_of(o) for o in found.optima), rng)
    if args.chain or not drawn.good:
        drawn = by_chain(found.problem, propose(found, rng)[0], seed)
    z, weight = drawn.z, drawn.weight
    values = values_of(found.problem, z)
    curve = frictions(found.problem, values)[""]
    known = truth.parameters()
    quantities = {"k_LC": (values["k_LC"], known["k_LC"])}
    quantities |= {k: (values[k], known[k]) for k in values if k.startswith("kappa[")}
    for hertz in (0.01, 80.0):
        at = int(np.argmin(np.abs(FREQUENCIES - hertz)))
        omega = 2 * np.pi * FREQUENCIES[at]
        true = abs(complex_friction(known, omega))
        quantities[f"|mu({hertz:g} Hz)|"] = (curve.magnitude[:, at], true)
    gap = overall_gap(channels(found, found.optima[0].z[None], seed))
    return [
        {
            "seed": seed, "quantity": name, "truth": f"{true:.8g}",
            "rank": f"{weighted_rank(v, weight, true):.5f}", "converged": drawn.good,
            "gap": f"{gap:.4f}", "modes": len(found.optima),
        }
        for name, (v, true) in quantities.items()
    ]  # fmt: skip


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

    from rigid.parameters import Parameter, Parameters
    from rigid.priors import Normal

    problem = found.problem
    parameters, best = problem.parameters, found.optima[0].z
    level = parameters.values(jnp.asarray(best[None]))
    known = tuple(
        Parameter(
            p.label, p.symbol, p.unit, Normal(0.5 * level[p.label][0], jnp.asarray(0.0)), p.varies
        )
        for p in parameters.sampled
        if p.base == "noise"
    )
    kept = tuple(p for p in parameters.sampled if p.base != "noise")
    new = Parameters(kept, parameters.known + known)
    return eqx.tree_at(lambda q: q.parameters, problem, new)


def verdict(rows: list[dict[str, str]]) -> str:
    """Table of coverage by quantity, campaigns as the unit, with the binomial band."""
    from scipy.stats import binom

    names = {"k_LC": "k_LC", "kappa": "kappa (every record)", "|mu(0.01 Hz)|": "|mu| at 0 Hz",
             "|mu(80 Hz)|": "|mu| at 80 Hz"}  # fmt: skip
    refused = sum(row["quantity"] == REFUSED for row in rows)
    lines = ["| quantity | campaigns | 50 % interval covers | band | 90 % interval covers | band |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for key, label in names.items():
        by_campaign: dict[str, list[float]] = {}
        for row in rows:
            if row["quantity"].split("[")[0] == key:
                by_campaign.setdefault(row["seed"], []).append(float(row["rank"]))
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


def main() -> int:
    args = options()
    part, parts = (int(x) for x in args.part.split("/"))
    from rigid.runtime import prepare

    prepare()
    name = "halved" if args.halve_noise else "coverage"
    if args.noise_correlation:
        name += f"-correlation-{args.noise_correlation:g}"
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / f"{name}.{part}.csv"
    done = {row["seed"] for row in rows_of(path)}
    for number in range(part, args.campaigns, parts):
        seed = FIRST_SEED + number
        if str(seed) in done:
            continue
        rows = one_campaign(seed, args)
        fresh = not path.exists()
        with path.open("a", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            if fresh:
                writer.writeheader()
            writer.writerows(rows)
        sys.stderr.write(f"campaign {number + 1} of {args.campaigns}: {rows[0]}\n")
    rows = [row for p in sorted(args.out.glob(f"{name}.?.csv")) for row in rows_of(p)]
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True,
                            text=True, check=False).stdout.strip()  # fmt: skip
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    head = f"`python {' '.join(sys.argv)}`, commit {commit}, {today}\n\n"
    (args.out / f"{name}.md").write_text(head + verdict(rows) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
