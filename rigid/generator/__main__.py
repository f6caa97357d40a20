"""Command line: `python -m rigid.generator --seed N --out DIR`."""

import argparse
import sys
from pathlib import Path

from rigid.generator.campaign import Conditions, campaign


def main(arguments: list[str] | None = None) -> int:
    """Write one campaign; gives the exit status."""
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
    options = parser.parse_args(arguments)
    if not 0.0 <= options.noise_correlation < 1.0:
        parser.error(f"--noise-correlation is {options.noise_correlation}; allowed is [0, 1)")
    if options.seed < 0:
        parser.error(f"--seed is {options.seed}; allowed is 0 or more")
    campaign(
        options.seed,
        options.out,
        specs=options.specs,
        field=not options.no_field,
        conditions=Conditions(options.noise_correlation),
    )
    sys.stderr.write(f"simulated campaign of seed {options.seed} written to {options.out}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
