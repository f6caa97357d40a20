"""Command line: `python -m rigid.generator --seed N --out DIR`."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from rigid.generator.campaign import campaign, drawn
from rigid.generator.conditions import NOMINAL, NULLS, Conditions, secret
from rigid.generator.draw import Secret, stream
from rigid.generator.hidden import HIDDEN, hide
from rigid.generator.strength import at_strength, ground

NOTHING = "none"


def main(arguments: list[str] | None = None) -> int:
    """Write one campaign; gives the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if not 0.0 <= options.noise_correlation < 1.0:
        parser.error(f"--noise-correlation is {options.noise_correlation}; allowed is [0, 1)")
    if options.seed < 0:
        parser.error(f"--seed is {options.seed}; allowed is 0 or more")
    if not options.strength > 0.0:
        parser.error(f"--strength is {options.strength}; allowed is above 0")
    if NOTHING in options.hide and len(options.hide) > 1:
        parser.error(f"--hide {NOTHING} stands beside others; name it alone")
    try:
        conditions, secrets = _conditions(options)
    except ValueError as error:
        parser.error(f"{error}; take another --seed or --strength")
    campaign(
        options.seed,
        options.out,
        specs=options.specs,
        field=not options.no_field,
        conditions=conditions,
        secrets=secrets,
    )
    sys.stderr.write(f"simulated campaign of seed {options.seed} written to {options.out}\n")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m rigid.generator",
        description="Write a simulated calibration campaign: records, specs and truth.",
    )
    parser.add_argument("--seed", type=int, required=True, help="the same seed, the same bytes")
    parser.add_argument("--out", type=Path, required=True, help="folder of records and truth")
    parser.add_argument("--specs", type=Path, help="folder of the specs (default: OUT)")
    parser.add_argument("--no-field", action="store_true", help="leave the field record out")
    parser.add_argument(
        "--noise-correlation", type=float, default=0.0, help="AR(1) coefficient, in [0, 1)"
    )
    parser.add_argument(
        "--hide",
        action="append",
        default=[],
        choices=[NOTHING, *HIDDEN],
        metavar="NAME",
        help="physics that no spec names; may stand more than once. One of: " + ", ".join(HIDDEN),
    )
    parser.add_argument(
        "--strength",
        type=float,
        default=8.0,
        help="of each, in units of noise once the constants are refitted (default 8)",
    )
    parser.add_argument(
        "--condition",
        action="append",
        default=[],
        choices=list(NULLS),
        help="what is wrong though no physics is missing; may stand more than once",
    )
    return parser


def _conditions(options: argparse.Namespace) -> tuple[Conditions, tuple[Secret, ...] | None]:
    """Conditions of the campaign, and what its truth says of what is hidden."""
    changed = {}
    for name in options.condition:
        chosen = NULLS[name]
        changed |= {
            key: getattr(chosen, key)
            for key in chosen.__dataclass_fields__
            if getattr(chosen, key) != getattr(NOMINAL, key)
        }
    if options.noise_correlation:
        changed["noise_correlation"] = options.noise_correlation
    conditions = replace(NOMINAL, **changed)
    names = [name for name in options.hide if name != NOTHING]
    if not names:
        return conditions, None
    truth = drawn(options.seed, conditions, field=not options.no_field)
    on = ground(truth)
    found = []
    for name in names:
        cause = hide(name, stream(options.seed, "hidden", name), truth.runs)
        found.append(at_strength(on, cause, options.strength))
    secrets = tuple(secret(truth, cause, strength) for cause, strength in found)
    return replace(conditions, hidden=tuple(cause for cause, _ in found)), secrets


if __name__ == "__main__":
    sys.exit(main())
