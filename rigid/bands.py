"""`python -m rigid.bands SPEC`: posterior and field records to ice load and displacement."""

import sys
from shutil import rmtree
from typing import TYPE_CHECKING

from rigid.cli import Options, run, say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tqdm import tqdm

    from rigid.smoothing.laws import Law
    from rigid.smoothing.run import Bands
    from rigid.spec import Spec

SAYS = "Ice load and plate displacement from field records, with uncertainty bands."

KEPT = "bands/unfinished"
"""Folder of what is known of each test, until the run is done."""


def bands(options: Options) -> int:
    """Make the bands of every field record; returns 0, or 1 if they must not be used."""
    from rigid.spec import find_spec, load_spec

    spec = load_spec(find_spec(options.spec))
    named = [] if spec.bands is None else [str(path) for path, _ in spec.bands.sources]
    say(options, f"spec {spec.path}: posterior {', '.join(named) or 'not named'}")

    from rigid.runtime import prepare

    prepare()
    import numpy as np

    from rigid.files import locked
    from rigid.smoothing.field import read_fields
    from rigid.smoothing.laws import draws, read_laws
    from rigid.smoothing.run import DRAWS

    seed = spec.sampler.seed if options.seed is None else options.seed
    rng = np.random.default_rng([seed, 4])
    laws = [
        law.only(rng.choice(law.size, min(DRAWS, law.size), replace=False))
        for law in read_laws(spec, rng)
    ]
    tests = read_fields(spec)
    for field in (field for test in tests for field in test):
        for law in laws:
            draws(law, field)  # refuses what the posterior does not hold before any work is done
    folder = options.folder(spec.path)
    with locked(folder):
        if not options.resume:
            rmtree(folder / KEPT, ignore_errors=True)
        found = [_made(spec, test, laws, options, seed) for test in tests]
        status = _written(spec, found, laws, options, seed)
        rmtree(folder / KEPT, ignore_errors=True)
        return status


def _made(
    spec: "Spec", fields: tuple, laws: "Sequence[Law]", options: Options, seed: int
) -> "Bands":
    """Learn how the load of a test moves under each law, then mix the draws; keep what is done."""
    from tqdm import tqdm

    from rigid.smoothing import kept
    from rigid.smoothing.run import bands as mixed
    from rigid.smoothing.run import learned, passes, ways

    name = fields[0].name
    path, mark = options.folder(spec.path) / KEPT / f"{name}.npz", kept.mark(fields, laws, seed)
    known = kept.load(path, mark, fields) if options.resume else kept.Kept()
    if known.bands is not None:
        say(options, f"{name}: taken from the run before")
        return known.bands
    with tqdm(disable=options.quiet, desc=f"{name}: learning", unit="pass") as bar:
        for law in laws[len(known.learned) :]:
            one = learned(spec, fields, law, lambda _: _step(bar))
            known = known._replace(learned=(*known.learned, one))
            kept.save(path, mark, known)
    under = ways(fields, known.learned, laws)
    with tqdm(total=passes(under), disable=options.quiet, desc=f"{name}: draws") as bar:
        known = known._replace(bands=mixed(under, seed, lambda _: _step(bar)))
    kept.save(path, mark, known)
    assert known.bands is not None  # just made
    return known.bands


def _step(bar: "tqdm") -> None:
    bar.update(1)


def _written(
    spec: "Spec", found: "list[Bands]", laws: "Sequence[Law]", options: Options, seed: int
) -> int:
    """Write every file and print the table or the JSON."""
    from rigid.report.bands import write_report
    from rigid.smoothing import output
    from rigid.smoothing.present import content

    folder = options.folder(spec.path)
    made = output.as_dict(spec.path.stem, spec.simulated, seed, found)
    for one in found:
        output.write_bands(folder / "bands", one)
    text = output.write_json(folder / "bands" / "bands.json", made)
    write_report(content(spec, made, found, sum(law.size for law in laws)), folder)
    note = "simulated data\n" if spec.simulated else ""
    sys.stdout.write(text if options.as_json else note + output.table(found))
    for check in made["checks"]:
        if not check["ok"]:
            sys.stderr.write(f"{check['name']}: {check['says']}\n")
    say(options, f"report: {folder / 'index.html'}")
    return 0 if made["usable"] else 1


if __name__ == "__main__":
    sys.exit(run("bands", SAYS, bands))
