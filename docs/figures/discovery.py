"""Make the README's figure of discovery from the simulated example of docs/discovery.md.

python -m rigid.generator --seed 110 --out campaign --hide hose-pressure-drop --strength 8
python docs/figures/discovery.py campaign/calibration.toml
"""

import sys
from pathlib import Path

import rigid
from rigid.plots.vector import svg
from rigid.report.discovery.figures.against import against_figure
from rigid.report.discovery.residuals import against


def main() -> None:
    """Write discovery.svg beside this file."""
    found = rigid.load(sys.argv[1]).discover(quiet=True)
    shown = against(found.outcome.steps[0]) if found.outcome.steps else None
    if shown is None:
        raise SystemExit("no effect of the catalogue was added: there is nothing to draw")
    text = svg(against_figure(shown, simulated=True), "readme-discovery")
    Path(__file__).with_name("discovery.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
