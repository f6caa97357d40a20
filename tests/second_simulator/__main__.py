"""`python -m tests.second_simulator POPULATION --seed N FOLDER`: one campaign in files."""

import argparse
import sys
from pathlib import Path

from . import POPULATIONS, campaign

parser = argparse.ArgumentParser(prog="tests.second_simulator", description=__doc__)
parser.add_argument("population", choices=sorted(POPULATIONS))
parser.add_argument("--seed", type=int, required=True)
parser.add_argument("folder", type=Path)
args = parser.parse_args()
sys.stdout.write(f"{campaign(args.population, args.seed, args.folder)}\n")
