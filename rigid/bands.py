"""`python -m rigid.bands SPEC`: posterior and field records to ice load and displacement."""

import sys
from shutil import rmtree
from typing import TYPE_CHECKING

from rigid.io.cli import Options, run, say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tqdm import tqdm

    from rigid.smoothing.finished import Finished
    from rigid.smoothing.laws import Law
    from rigid.smoothing.learning import Learned
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

    from rigid.io.runtime import prepare

    prepare()
    import numpy as np

    from rigid.io.files import locked
    from rigid.smoothing.field import read_fields
    from rigid.smoothing.laws import draws, read_laws, some

    seed = spec.sampler.seed if options.seed is None else options.seed
    rng = np.random.default_rng([seed, 4])
    laws = [some(law, spec, rng) for law in read_laws(spec, rng)]
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
) -> "Finished":
    """Make the bands of a test and write its files; gives what report and summary need of it."""
    from rigid.report.bands import output
    from rigid.report.bands.present import finished
    from rigid.smoothing import kept
    from rigid.smoothing.run import bands as mixed
    from rigid.smoothing.run import blocks, ways
    from rigid.smoothing.smoother import Keeping

    name = fields[0].name
    folder, mark = options.folder(spec.path), kept.mark(fields, laws, seed)
    path = folder / KEPT / f"{name}.json"
    done = kept.load_finished(path, mark) if options.resume else None
    if done is not None:
        say(options, f"{name}: taken from the run before")
        return done
    under = ways(fields, _learned(spec, fields, laws, options, mark), laws)
    with _bar(options, f"{name}: draws", "block", blocks(under)) as bar:
        found = mixed(under, seed, Keeping(folder / KEPT, lambda count: _step(bar, count)))
    output.write_bands(folder / "bands", found)
    done = finished(found, spec.simulated)
    output.write_figures(folder / "bands", done)
    kept.save_finished(path, mark, done)
    path.with_suffix(".npz").unlink()
    return done


def _learned(
    spec: "Spec", fields: tuple, laws: "Sequence[Law]", options: Options, mark: str
) -> "tuple[tuple[Learned, ...], ...]":
    """Learn how the load of a test moves under each law; keep what is done."""
    from rigid.smoothing import kept
    from rigid.smoothing.run import learned

    name = fields[0].name
    path = options.folder(spec.path) / KEPT / f"{name}.npz"
    known = kept.load(path, mark, len(fields)) if options.resume else ()
    with _bar(options, f"{name}: learning", "pass", None) as bar:
        for law in laws[len(known) :]:
            known = (*known, learned(spec, fields, law, lambda count: _step(bar, count)))
            kept.save(path, mark, known)
    return known


def _bar(options: Options, says: str, unit: str, total: int | None) -> "tqdm":
    from tqdm import tqdm

    return tqdm(total=total, disable=options.quiet, desc=says, unit=unit)


def _step(bar: "tqdm", count: int) -> None:
    bar.update(count)


def _written(
    spec: "Spec", found: "list[Finished]", laws: "Sequence[Law]", options: Options, seed: int
) -> int:
    """Write what is told of all tests together and print the table or the JSON."""
    from rigid.report.bands import output
    from rigid.report.bands.present import content
    from rigid.report.bands.section import write_report

    folder = options.folder(spec.path)
    made = output.as_dict(spec.path.stem, spec.simulated, seed, found)
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
