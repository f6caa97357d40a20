"""`python -m rigid.laws SPEC`: which law of friction the records speak for."""

import sys

from rigid.io.cli import Options, answer, run

SAYS = "Compare laws of friction on the records: evidence, left-out records, and what parts them."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("laws", SAYS, compare_laws, arguments)


def compare_laws(options: Options) -> int:
    """Run the comparison and write its files; returns 0, or 1 if no law explains the records."""
    from rigid.spec.opening import open_spec

    spec = open_spec(options)

    from rigid.io.runtime import prepare

    prepare()
    from rigid.report.taken import lines
    from rigid.study.study import Study

    folder = options.folder(spec.path)
    found = Study(spec).laws(folder, seed=options.seed, resume=options.resume, quiet=options.quiet)
    printed, checks = found.json() if options.as_json else found.table(), found.result["checks"]
    return answer(options, folder, printed, found.usable, checks, lines(found.result))


if __name__ == "__main__":
    sys.exit(main())
