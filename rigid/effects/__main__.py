"""`python -m rigid.effects`: the page of the catalogue, made from the classes."""

import argparse
import inspect
import sys
from pathlib import Path

from rigid.effects import CATALOGUE, AbstractEffect, PriorDescription
from rigid.effects.base import MOTION

HEAD = """# Catalogue of effects

What can act on the rig, each entry with its equation, its parameters and priors, where it comes
from, the signature that it has in the records and the siblings it can be mistaken for. Figures
in brackets beside siblings are cosine similarities between signatures, once all uncertain constants
have absorbed what their priors let them (a first computation with an independent simulator). This
page is made from the classes by `python -m rigid.effects --write docs/catalogue.md`; a test holds
its entries to them.

*Steady* effects leave the Jacobian of the motion as it is at rest, so that a rig of them alone
takes the long steps of `rigid/physics/slow.py`; any other goes by the short steps of
`rigid/physics/staggered.py`.
*Slow* records are all that follow a programme of the valve: frames, free runs, field tests.
*Absent at* is the value at which the effect is not there.
"""


def _prior(prior: PriorDescription) -> str:
    return f"{prior.law}({', '.join(f'{k} {v:.4g}' for k, v in prior.arguments.items())})"


def section(effect: type[AbstractEffect]) -> str:
    """What the page says of an effect."""
    doc = inspect.cleandoc(effect.__doc__ or "")
    rows = [
        f"| `{label}` | {info.meaning} | {info.unit} | {_prior(prior)} | "
        f"{'none' if info.absent is None else f'{info.absent:g}'} |"
        for info in effect.parameters()
        for label, prior in zip(info.labels, info.priors, strict=True)
    ]
    table = "\n".join(
        ["| parameter | meaning | unit | prior | absent at |", "|---|---|---|---|---|", *rows]
    )
    every = "all records" if effect.acts_in(MOTION) else "all records of the rig"
    acts = every if effect.kinds is None else ", ".join(effect.kinds)
    way = "steady" if effect.steady else "not steady"
    last = f"Source: {effect.source}. Acts in: {acts}; {way}."
    told = f"{effect.phrase[0].upper()}{effect.phrase[1:]}. Equation: {effect.equation}."
    return f"## {effect.name}\n\n{told}\n\n{doc}\n\n{table}\n\n{last}\n"


def page() -> str:
    """Return docs/catalogue.md."""
    return "\n".join([HEAD, *map(section, CATALOGUE.values())])


def main() -> None:
    """Write the page to a file, or to standard output."""
    parser = argparse.ArgumentParser(prog="python -m rigid.effects", description=__doc__)
    parser.add_argument("--write", metavar="PATH", type=Path, help="file to write the page to")
    path = parser.parse_args().write
    if path is None:
        sys.stdout.write(page())
    else:
        path.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
