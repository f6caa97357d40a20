"""Which mix of emcee's moves, and which law to begin from, gives most effective samples a second?

    python tests/studies/mixes.py --out docs/studies/mixes

Samples three campaigns with every mix and from both laws: the reference campaign, the same with a
constant coefficient (a model that misses something), and a campaign of the generator whose friction
is drawn as widely as the fit's own priors allow. Each run has the same likelihood, seed and number
of steps. Writes OUT.jsonl, a line a run, and OUT.md; resumable. The comparison is by effective
samples an evaluation, which other work on the machine does not change; evaluations are nearly all
that a chain's seconds go to.
"""

import argparse
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rows import carry_out, lines_of

ROOT = Path(__file__).resolve().parents[2]
SEED, GENERATED = 5, 720_001
"""Of the searches and chains; of the generated campaign (development)."""
STARTS, ENSEMBLES, BLOCK, STEPS = 4, 2, 50, 400
OUT_OF_REACH = 1e6
"""Effective samples that no chain of so many steps has, so that all run to their end."""

CHOSEN = "mostly independence (the command's)"
BEGUN_TWICE = "half independence"
"""The mix that both laws are compared with."""
MIXES = {
    "independence alone": (1.0, 0.0, 0.0),
    CHOSEN: (0.8, 0.15, 0.05),
    BEGUN_TWICE: (0.5, 0.35, 0.15),
    "a fifth independence": (0.2, 0.55, 0.25),
    "differential evolution and snooker": (0.0, 0.8, 0.2),
}
LAWS = ("Gaussian at the optima", "fitted to weighted draws (the command's)")


class Run(NamedTuple):
    """One chain: of which campaign, by which moves, from which law."""

    number: int
    campaign: str
    mix: str
    law: str


def runs() -> list[Run]:
    """List every chain: all mixes from the fitted law, one of them from both."""
    found = []
    for campaign in ("reference", "constant coefficient", "wide friction"):
        found += [Run(0, campaign, mix, LAWS[1]) for mix in MIXES]
        found.append(Run(0, campaign, BEGUN_TWICE, LAWS[0]))
    return [run._replace(number=number) for number, run in enumerate(found)]


def problem_of(campaign: str, folder: Path):
    """Read a campaign and search its best fits."""
    from rigid.generator import Conditions
    from rigid.generator.campaign import campaign as made
    from rigid.inference.search import search
    from rigid.likelihood.assemble import assemble
    from rigid.records.read import read_records
    from rigid.spec import load_spec

    path = ROOT / "fits" / "calibration.toml"
    if campaign == "constant coefficient":
        path = ROOT / "fits" / "constant-mu.toml"
    if campaign == "wide friction":
        made(GENERATED, folder, field=False, conditions=Conditions(wide_friction=True))
        path = folder / "calibration.toml"
    spec = load_spec(path)
    return search(assemble(spec, read_records(spec)), STARTS, SEED)


class Found:
    """Searches and laws, made when first asked for."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.known: dict = {}

    def of(self, campaign: str):
        """The search of a campaign, and both laws by name."""
        if campaign not in self.known:
            from rigid.inference.calibrate import trusted
            from rigid.inference.proposal import MixtureProposal

            found = problem_of(campaign, self.folder)
            known = trusted(found, SEED)
            modes = tuple(known.chart.mode(o) for o in found.optima)
            plain = MixtureProposal(modes, np.ones(len(modes)) / len(modes), known.law.dof)
            self.known[campaign] = known, dict(zip(LAWS, (plain, known.law), strict=True))
        return self.known[campaign]


def measured(run: Run, found: Found) -> dict:
    """Sample; gives the least ESS of any parameter, seconds and acceptance."""
    import jax.numpy as jnp

    from rigid.inference import convergence, moves
    from rigid.inference.sample import Settings, sample
    from rigid.likelihood.problem import log_posterior, walkers

    searched, laws = found.of(run.campaign)
    problem, chart, weights = searched.found.problem, searched.chart, searched.weights
    settings = Settings(
        ensembles=ENSEMBLES, walkers=walkers(problem), block=BLOCK, max_steps=STEPS,
        r_hat=1.0, ess=OUT_OF_REACH, seed=SEED,
    )  # fmt: skip
    # The command has one mix; a study of others has to put them in its place.
    moves.INDEPENDENCE, moves.EVOLUTION, moves.SNOOKER = MIXES[run.mix]
    density = chart.density(lambda z: np.asarray(log_posterior(problem, jnp.asarray(z))))
    draws = sample(density, laws[run.law], settings)
    told = [convergence.diagnose(str(i), draws.z[..., i]) for i in range(draws.z.shape[-1])]
    least, worst = convergence.least_ess(told), convergence.worst_r_hat(told)
    assert least is not None
    assert least.ess_bulk is not None
    assert worst is not None
    assert worst.r_hat is not None
    return {
        "case": run._asdict(),
        "ess": round(least.ess_bulk, 1),
        "r_hat": round(worst.r_hat, 4),
        "seconds": round(draws.seconds, 2),
        "evaluations": draws.evaluations,
        "acceptance": round(float(draws.acceptance.mean()), 3),
        "pareto_k": round(float(weights.pareto_k), 2),
    }


def page(rows: list[dict]) -> str:
    """The table, one campaign after the other."""
    head = (
        "| moves | begun from | least ESS | R-hat | accepted | ESS a second "
        "| ESS a thousand evaluations | to the command's |"
    )
    out = [
        "# Which moves, and where to begin",
        "",
        f"`python tests/studies/mixes.py --out docs/studies/mixes`, code of "
        f"{', '.join(sorted({r['commit'] for r in rows}))}.",
        "",
        f"{ENSEMBLES} ensembles, {STEPS} steps, the first quarter dropped; the least effective",
        "sample size of any parameter; seconds are those of the chain, the last column compares by",
        "evaluations. All of it is simulated data. An R-hat far above 1 means that the effective",
        "sample size before it is too high.",
    ]
    for campaign in dict.fromkeys(r["case"]["campaign"] for r in rows):
        mine = [r for r in rows if r["case"]["campaign"] == campaign]
        yields = {Run(**r["case"]): 1e3 * r["ess"] / r["evaluations"] for r in mine}
        own = next((v for run, v in yields.items() if run[2:] == (CHOSEN, LAWS[1])), np.nan)
        shape = mine[0]["pareto_k"]
        out += ["", f"## {campaign.capitalize()}", ""]
        out += [f"Pareto shape of the fitted law's weights: {shape:.2f}.", "", head]
        out += ["|" + "---|" * 8]
        for row in mine:
            run = Run(**row["case"])
            out.append(
                f"| {run.mix} | {run.law} | {row['ess']:.0f} | {row['r_hat']:.3f} | "
                f"{100 * row['acceptance']:.0f} % | {row['ess'] / row['seconds']:.1f} | "
                f"{yields[run]:.1f} | {yields[run] / own:.2f} |"
            )
    return "\n".join(out) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "studies" / "mixes")
    parser.add_argument("--page", action="store_true", help="write the page from what there is")
    args = parser.parse_args()
    path = args.out.with_suffix(".jsonl")
    if not args.page:
        from rigid.io.runtime import prepare

        prepare()
        with tempfile.TemporaryDirectory() as name:
            found = Found(Path(name))
            carry_out(path, runs(), lambda run: measured(run, found), lambda row: row["ess"])
    args.out.with_suffix(".md").write_text(page(lines_of([path])), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
