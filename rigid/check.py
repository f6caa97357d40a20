"""`python -m rigid.check SPEC`: spec and records read and judged, nothing run."""

import sys

from rigid.io.cli import Options, run
from rigid.io.files import json_text

SAYS = "Read spec and records and say what a fit would do; --schema prints the specs' JSON Schema."


def main(arguments: list[str] | None = None) -> int:
    """Run the command, or print the schema that editors complete and check specs with."""
    given = sys.argv[1:] if arguments is None else arguments
    if "--schema" in given:
        from rigid.spec.values import schema

        sys.stdout.write(json_text(schema()))
        return 0
    return run("check", SAYS, check, arguments)


def check(options: Options) -> int:
    """Say what a fit of the spec would do; returns 0."""
    from rigid.spec.opening import open_spec

    spec = open_spec(options)

    from rigid.io.runtime import prepare

    prepare(as_command=True)
    from rigid.study.study import Study

    found = Study(spec).check()
    sys.stdout.write(found.json() if options.as_json else found.table())
    return 0


if __name__ == "__main__":
    sys.exit(main())
