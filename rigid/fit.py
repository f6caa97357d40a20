"""`python -m rigid.fit SPEC`: records to posterior to report. The pipeline on one page."""

import sys
import time
from typing import TYPE_CHECKING

from rigid.io.cli import Options, answer, run, say

if TYPE_CHECKING:
    from rigid.spec import Spec

SAYS = "Calibrate a rig: records in, posterior of its parameters and a report out."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("fit", SAYS, fit, arguments)


def fit(options: Options) -> int:
    """Calibrate and write all files; returns 0, or 1 if the result must not be used."""
    from rigid.spec.opening import open_spec

    spec = open_spec(options)
    if spec.published is not None:
        return fit_published(spec, options)

    from rigid.io.runtime import prepare

    prepare()
    from rigid.report.calibration.output import printed
    from rigid.report.taken import lines
    from rigid.study.study import Study

    folder = options.folder(spec.path)
    found = Study(spec).fit(folder, seed=options.seed, resume=options.resume, quiet=options.quiet)
    text, checks = printed(found.result, folder, options.as_json), map(vars, found.checks)
    return answer(options, folder, text, found.usable, checks, lines(found.result.taken))


def fit_published(spec: "Spec", options: Options) -> int:
    """Tell all stories and write all files; returns 0, or 1 if the result must not be used.

    Raises InputError for a spec that names records as well.
    """
    began = time.monotonic()
    from rigid.io.errors import InputError

    if spec.records:
        raise InputError(
            f"{spec.path}: has [published] numbers and {len(spec.records)} records; a fit takes "
            "one or the other, put them into two specs"
        )
    from rigid.io.runtime import prepare

    prepare()
    from rigid.io.files import locked
    from rigid.published.run import run
    from rigid.report.published import output
    from rigid.report.published.present import content
    from rigid.report.published.section import KIND
    from rigid.report.section import write_report

    folder = options.folder(spec.path)
    seed = spec.sampler.seed if options.seed is None else options.seed
    with locked(folder):
        found = run(spec, seed, lambda line: say(options, line))
        text = output.write(folder, spec, found, began)
        write_report(KIND, content(spec, found), folder)
    printed = text if options.as_json else output.table(found)
    return answer(options, folder, printed, found.usable, output.checks(found))


if __name__ == "__main__":
    sys.exit(main())
