"""`python -m rigid.bands SPEC`: posterior and field records to ice load and displacement."""

import sys

from rigid.io.cli import Options, answer, run, say

SAYS = "Ice load and plate displacement from field records, with uncertainty bands."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("bands", SAYS, bands, arguments)


def bands(options: Options) -> int:
    """Make the bands of every field record; returns 0, or 1 if they must not be used."""
    from rigid.spec.opening import open_spec

    spec = open_spec(options)
    named = [] if spec.bands is None else [str(path) for path, _ in spec.bands.sources]
    say(options, f"spec {spec.path}: posterior {', '.join(named) or 'not named'}")

    from rigid.io.runtime import prepare

    prepare()
    from rigid.report.bands.output import table
    from rigid.study.study import Study

    folder = options.folder(spec.path)
    found = Study(spec).write_bands(
        folder, seed=options.seed, resume=options.resume, quiet=options.quiet
    )
    note = "simulated data\n" if spec.simulated else ""
    printed = found.text if options.as_json else note + table(found.tests)
    return answer(options, folder, printed, found.result["usable"], found.result["checks"])


if __name__ == "__main__":
    sys.exit(main())
