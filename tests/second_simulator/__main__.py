"""`python -m tests.second_simulator --population NAME --seed N --out DIR`."""

import argparse
import sys
from pathlib import Path

from . import POPULATIONS, campaign

parser = argparse.ArgumentParser(description=(__doc__ or "").strip())
parser.add_argument("--population", choices=sorted(POPULATIONS), required=True)
parser.add_argument("--seed", type=int, required=True)
parser.add_argument("--out", type=Path, required=True)
args = parser.parse_args()
sys.stdout.write(f"{campaign(args.population, args.seed, args.out)}\n")
