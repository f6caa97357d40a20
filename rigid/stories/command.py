"""The fit of a spec that holds published numbers in place of records."""

import sys
import time

from rigid.cli import Options, say
from rigid.errors import InputError
from rigid.spec import Spec


def fit_published(spec: Spec, options: Options) -> int:
    """Tell all stories and write all files; returns 0, or 1 if the result must not be used.

    Raises InputError for a spec that names records as well.
    """
    began = time.monotonic()
    if spec.records:
        raise InputError(
            f"{spec.path}: has [published] numbers and {len(spec.records)} records; a fit takes "
            "one or the other, put them into two specs"
        )
    from rigid.runtime import prepare

    prepare()
    from rigid.files import locked
    from rigid.report.stories import write_report
    from rigid.stories import output
    from rigid.stories.present import content
    from rigid.stories.run import run

    folder = options.folder(spec.path)
    seed = spec.sampler.seed if options.seed is None else options.seed
    with locked(folder):
        found = run(spec, seed, lambda line: say(options, line))
        text = output.write(folder, spec, found, began)
        write_report(content(spec, found), folder)
    sys.stdout.write(text if options.as_json else output.table(found))
    for check in output.checks(found):
        if not check["ok"]:
            sys.stderr.write(f"{check['name']}: {check['says']}\n")
    say(options, f"report: {folder / 'index.html'}")
    return 0 if found.usable else 1
