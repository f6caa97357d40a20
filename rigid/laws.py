"""`python -m rigid.laws SPEC`: which law of friction the records speak for."""

import json
import sys
from typing import TYPE_CHECKING

from rigid.io.cli import Options, run, say

if TYPE_CHECKING:
    from rigid.friction.comparison import Comparison
    from rigid.localfit.next_record import Proposal
    from rigid.spec import Spec

SAYS = "Compare laws of friction on the records: evidence, left-out records, and what parts them."


def compare_laws(options: Options) -> int:
    """Run the comparison and write its files; returns 0, or 1 if no law explains the records."""
    from rigid.spec import find_spec, load_spec

    spec = load_spec(find_spec(options.spec))
    say(options, f"spec {spec.path}: {len(spec.records)} records")

    from rigid.io.runtime import prepare

    prepare()
    from rigid.friction.comparison import compare
    from rigid.friction.fits import fit_laws
    from rigid.friction.models import laws, without_friction
    from rigid.friction.next_record import next_record
    from rigid.io.files import locked
    from rigid.likelihood.assemble import assemble, given_laws
    from rigid.records.read import read_records

    seed = spec.sampler.seed if options.seed is None else options.seed
    plain = without_friction(spec)
    problem = assemble(plain, read_records(spec))
    with locked(options.folder(spec.path)):
        listed = laws(spec, problem)
        fitted = fit_laws(problem, listed, given_laws(spec), seed, lambda t: say(options, t))
        say(options, "comparing")
        found = compare(fitted, seed)
        return _written(spec, found, next_record(found), options, seed)


def _written(
    spec: "Spec", found: "Comparison", further: "Proposal | None", options: Options, seed: int
) -> int:
    """Write every file and print the table or the JSON."""
    from rigid.io.files import write_text
    from rigid.report.laws.output import as_csv, as_dict
    from rigid.report.laws.present import content, table
    from rigid.report.laws.section import write_report

    folder = options.folder(spec.path)
    made = as_dict(spec, found, further, seed)
    text = json.dumps(made, indent=1, allow_nan=False) + "\n"
    write_text(folder / "laws.json", text)
    write_text(folder / "laws.csv", as_csv(made))
    write_report(content(spec, made), folder)
    sys.stdout.write(text if options.as_json else table(made))
    if not made["usable"]:
        sys.stderr.write(f"no law explains the records: gap {made['gap']:.2f}\n")
    say(options, f"report: {folder / 'index.html'}")
    return 0 if made["usable"] else 1


if __name__ == "__main__":
    sys.exit(run("laws", SAYS, compare_laws))
