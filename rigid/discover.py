"""`python -m rigid.discover SPEC`: where model and data disagree, and what is missing."""

import sys

from rigid.io.cli import Options, answer, run

SAYS = "Find where model and data disagree, name the missing effect, add it, show the gap shrink."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("discover", SAYS, discover, arguments)


def discover(options: Options) -> int:
    """Run the workflow and write its files; returns 0, or 1 if it must not be used."""
    from rigid.spec.opening import open_spec

    spec = open_spec(options)

    from rigid.io.runtime import prepare

    prepare()
    from rigid.report.taken import lines
    from rigid.study.study import Study

    folder = options.folder(spec.path)
    found = Study(spec).discover(
        folder, seed=options.seed, resume=options.resume, quiet=options.quiet
    )
    printed, checks = found.json() if options.as_json else found.table(), found.result["checks"]
    return answer(options, folder, printed, found.usable, checks, lines(found.result))


if __name__ == "__main__":
    sys.exit(main())
