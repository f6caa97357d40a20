"""Does NUTS, which shares no sampler code with emcee, draw the same posterior?

    python -m rigid.fit calibration
    python tests/studies/nuts.py [--posterior reports/calibration/posterior.nc] [--quick]

Draws from rigid's own log-posterior of the reference campaign by blackjax's NUTS (optional extra:
`pip install -e .[nuts]`), driven by its reverse-mode gradient in coordinates whitened by the
Gaussian that the search lays over the best mode, and prints a table beside emcee's draws.

One program takes a step of all chains and is compiled once (minutes, for the gradient; kept
between runs); the step size is tuned between its calls.
"""

import argparse
import sys
import time
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SPEC = ROOT / "fits" / "calibration.toml"
SEED = 3
CHAINS = 4
ACCEPTANCE = 0.8
DOUBLINGS = 8
HERTZ = 80.0


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--posterior", type=Path, default=Path("reports/calibration/posterior.nc"))
    parser.add_argument("--warmup", type=int, default=150)
    parser.add_argument("--draws", type=int, default=400)
    parser.add_argument("--quick", action="store_true", help="few starts and draws: shows it runs")
    parser.add_argument("--out", type=Path, help="file for the table")
    return parser.parse_args()


def whitened(found):
    """Value and gradient at one point u (size,), and the map u -> z of the best mode."""
    import jax.numpy as jnp
    import numpy as np

    from rigid.likelihood.problem import log_posterior

    best = found.optima[0]
    factor, mean = jnp.asarray(np.linalg.cholesky(best.covariance)), jnp.asarray(best.z)

    def to_z(u):
        return mean + u @ factor.T

    def density(problem, u):
        return log_posterior(problem, to_z(u)[None])[0]

    return density, to_z


def compiled(density, size: int):
    """Two programs for all chains: value and gradient at u, and a step of NUTS."""
    import blackjax  # pyright: ignore[reportMissingImports]
    import equinox as eqx
    import jax
    import jax.numpy as jnp

    kernel, mass = blackjax.nuts.build_kernel(), jnp.ones(size)

    @eqx.filter_jit
    def gradients(problem, u):
        return jax.vmap(jax.value_and_grad(partial(density, problem)))(u)

    @eqx.filter_jit
    def advance(problem, keys, states, step_size):
        def one(key, state):
            return kernel(key, state, partial(density, problem), step_size, mass, DOUBLINGS)

        return jax.vmap(one)(keys, states)

    return gradients, advance


def sampled(found, warmup: int, draws: int):
    """Points z (chains, draws, size), gradients a draw, step size and divergences."""
    import jax
    import jax.numpy as jnp
    import numpy as np
    from blackjax.adaptation.step_size import (  # pyright: ignore[reportMissingImports]
        dual_averaging_adaptation,
    )
    from blackjax.mcmc.hmc import HMCState  # pyright: ignore[reportMissingImports]

    density, to_z = whitened(found)
    size = found.problem.parameters.size
    gradients, advance = compiled(density, size)
    u = jnp.asarray(np.random.default_rng(SEED).standard_normal((CHAINS, size)))
    value, slope = gradients(found.problem, u)
    finite = bool(jnp.isfinite(value).all() & jnp.isfinite(slope).all())
    sys.stderr.write(f"reverse mode: value and gradient finite: {finite}\n")
    state = HMCState(u, value, slope)
    begin, update, final = dual_averaging_adaptation(ACCEPTANCE)
    averaging, step_size = begin(0.3), 0.3
    kept, steps, diverged = [], 0, 0
    for i in range(warmup + draws):
        keys = jax.random.split(jax.random.PRNGKey(SEED * 1_000_000 + i), CHAINS)
        state, info = advance(found.problem, keys, state, jnp.asarray(step_size))
        if i < warmup:
            averaging = update(averaging, jnp.mean(info.acceptance_rate))
            last = i == warmup - 1
            step_size = float(final(averaging) if last else jnp.exp(averaging.log_step_size))
            continue
        kept.append(np.asarray(to_z(state.position)))
        steps += int(info.num_integration_steps.sum())
        diverged += int(info.is_divergent.sum())
    return np.stack(kept, axis=1), steps / (CHAINS * draws), step_size, diverged


def quantities(problem, values) -> dict:
    """k_LC, every kappa, abs(mu) at 80 Hz; draws of each, flat."""
    import numpy as np

    from rigid.inference.derived import frictions
    from rigid.inference.friction_curve import FREQUENCIES

    at = int(np.argmin(np.abs(FREQUENCIES - HERTZ)))
    named = {k: v for k, v in values.items() if k == "k_LC" or k.startswith("kappa")}
    return named | {f"abs(mu) at {HERTZ:g} Hz": frictions(problem, values)[""].magnitude[:, at]}


def one_of(drawn, parameter):
    """Draws (n,) of a parameter from a dataset with dimensions."""
    series = drawn[parameter.base]
    return series.sel(dict(zip(series.dims[2:], parameter.places, strict=True))).values.ravel()


def of_emcee(path: Path, problem) -> dict:
    """SI values of emcee's draws, flat, by label; what is known comes along."""
    import numpy as np

    from rigid.inference.posterior import load_posterior

    drawn = load_posterior(path)["posterior"].dataset
    values = {p.label: one_of(drawn, p) for p in problem.parameters.sampled}
    known = {
        p.label: float(p.prior.from_standard(np.zeros(1))[0]) for p in problem.parameters.known
    }
    count = len(next(iter(values.values())))
    return values | {k: np.full(count, v) for k, v in known.items()}


def table(ours: dict, theirs: dict, sizes: dict[str, float]) -> str:
    """Medians and widths (5 % to 95 %) beside each other."""
    import numpy as np

    lines = [
        "| quantity | emcee median | NUTS median | apart, in NUTS's standard errors "
        "| emcee width | NUTS width | NUTS ESS |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, nuts in ours.items():
        (low, mid, high), (l2, m2, h2) = (
            np.quantile(x, (0.05, 0.5, 0.95)) for x in (theirs[name], nuts)
        )
        error = 1.2533 * nuts.std(ddof=1) / np.sqrt(sizes[name])  # of a median, Gaussian
        lines.append(
            f"| {name} | {mid:.5g} | {m2:.5g} | {(m2 - mid) / error:+.1f} "
            f"| {high - low:.3g} | {h2 - l2:.3g} | {sizes[name]:.0f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    args = options()
    from rigid.io.runtime import prepare

    prepare()
    from rigid.inference.convergence import effective_sizes
    from rigid.inference.derived import values_of
    from rigid.inference.search import search
    from rigid.likelihood.assemble import assemble
    from rigid.records.read import read_records
    from rigid.spec import load_spec

    spec = load_spec(SPEC)
    starts, warmup, draws = spec.sampler.starts, args.warmup, args.draws
    if args.quick:
        starts, warmup, draws = 2, 30, 40
    found = search(assemble(spec, read_records(spec)), starts, spec.sampler.seed)
    theirs = quantities(found.problem, of_emcee(args.posterior, found.problem))
    began = time.monotonic()
    z, steps, step_size, diverged = sampled(found, warmup, draws)
    ours = quantities(found.problem, values_of(found.problem, z.reshape(-1, z.shape[-1])))
    sizes = {k: effective_sizes(v.reshape(CHAINS, -1).T[None])[0] for k, v in ours.items()}
    text = table(ours, theirs, sizes)
    text += (
        f"\nNUTS: {CHAINS} chains of {draws} draws after {warmup}, {steps:.1f} gradients a draw, "
        f"step {step_size:.2f}, {diverged} divergences, {time.monotonic() - began:.0f} s; modes "
        f"found: {len(found.optima)}.\n"
    )
    sys.stdout.write(text)
    if args.out is not None:
        args.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
