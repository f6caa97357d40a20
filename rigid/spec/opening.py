"""A spec as a command opens it: told on the terminal, its own code first."""

import sys

from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.io.progress import say
from rigid.spec.read import find_spec, load_spec
from rigid.spec.values import Spec

OWN = ":"


def own_code(spec: Spec) -> tuple[str, ...]:
    """Names of code that a spec brings along, `module:Class`, which runs when the spec does."""
    named = (*spec.model.effects, *(spec.model.candidates or ()))
    return tuple(dict.fromkeys(name for name in named if OWN in name))


def require_none_of_its_own(spec: Spec) -> None:
    """Raise InputError for a spec that brings code along."""
    if names := own_code(spec):
        raise InputError(
            f"{spec.path}: runs code of its own ({', '.join(names)}), which --no-own-code refuses; "
            "read that code, then leave the option out"
        )


def open_spec(options: Options) -> Spec:
    """Return the spec that a command was given, and say what it is.

    That it runs code of its own is said whether or not the command is to be quiet.

    Raises InputError for mistakes in it, and for code of its own where the options refuse it.
    """
    spec = load_spec(find_spec(options.spec))
    if not options.own_code:
        require_none_of_its_own(spec)
    for name in own_code(spec):
        sys.stderr.write(f"spec {spec.path} runs code of its own: {name}\n")
    say(options.quiet, f"spec {spec.path}: {len(spec.records)} records")
    return spec
