"""`python -m rigid.bands SPEC`: posterior and field records to ice load and displacement."""

import sys
from typing import TYPE_CHECKING

from rigid.cli import Options, run, say

if TYPE_CHECKING:
    from pathlib import Path

    from tqdm import tqdm

    from rigid.smoothing.laws import Law
    from rigid.smoothing.run import Bands
    from rigid.spec import Spec

SAYS = "Ice load and plate displacement from field records, with uncertainty bands."


def bands(options: Options) -> int:
    """Make the bands of every field record; returns 0, or 1 if they must not be used."""
    from rigid.spec import find_spec, load_spec

    spec = load_spec(find_spec(options.spec))
    posterior = _posterior(spec)
    say(options, f"spec {spec.path}: posterior {posterior}")

    from rigid.runtime import prepare

    prepare()
    import numpy as np

    from rigid.files import locked
    from rigid.smoothing.field import read_fields
    from rigid.smoothing.laws import draws, read_law
    from rigid.smoothing.run import DRAWS

    seed = spec.sampler.seed if options.seed is None else options.seed
    rng = np.random.default_rng([seed, 4])
    law = read_law(spec, posterior, rng)
    law = law.only(rng.choice(law.size, min(DRAWS, law.size), replace=False))
    tests = read_fields(spec)
    for field in (field for test in tests for field in test):
        draws(law, field)  # refuses what the posterior does not hold before any work is done
    folder = options.folder(spec.path)
    with locked(folder):
        found = [_made(spec, test, law, options, seed) for test in tests]
        return _written(spec, found, law, options, seed)


def _posterior(spec: "Spec") -> "Path":
    """The posterior the spec names, or what to do."""
    from rigid.errors import InputError

    if spec.bands is None:
        raise InputError(
            f'{spec.path}: has no [bands] posterior = "..."; name the posterior.nc that '
            "`python -m rigid.fit` wrote"
        )
    return spec.bands.posterior


def _made(spec: "Spec", fields: tuple, law: "Law", options: Options, seed: int) -> "Bands":
    """Learn how the load of a test moves, then mix the draws."""
    from tqdm import tqdm

    from rigid.smoothing.run import Way, learned, passes, prepared
    from rigid.smoothing.run import bands as mixed

    name = fields[0].name
    with tqdm(disable=options.quiet, desc=f"{name}: learning", unit="pass") as bar:
        found = learned(spec, fields, law, lambda _: _step(bar))
    way = Way(prepared(fields, found), law)
    with tqdm(total=passes([way]), disable=options.quiet, desc=f"{name}: draws") as bar:
        return mixed([way], seed, lambda _: _step(bar))


def _step(bar: "tqdm") -> None:
    bar.update(1)


def _written(spec: "Spec", found: list, law: "Law", options: Options, seed: int) -> int:
    """Write every file and print the table or the JSON."""
    from rigid.report.bands import write_report
    from rigid.smoothing import output
    from rigid.smoothing.present import content

    folder = options.folder(spec.path)
    made = output.as_dict(spec.path.stem, spec.simulated, seed, found)
    for one in found:
        output.write_bands(folder / "bands", one)
    text = output.write_json(folder / "bands" / "bands.json", made)
    write_report(content(spec, made, found, law.size), folder)
    note = "simulated data\n" if spec.simulated else ""
    sys.stdout.write(text if options.as_json else note + output.table(found))
    for check in made["checks"]:
        if not check["ok"]:
            sys.stderr.write(f"{check['name']}: {check['says']}\n")
    say(options, f"report: {folder / 'index.html'}")
    return 0 if made["usable"] else 1


if __name__ == "__main__":
    sys.exit(run("bands", SAYS, bands))
