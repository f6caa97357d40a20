"""Make the README's figure of discovery from the simulated example of docs/discovery.md.

python -m rigid.generator --seed 110 --out campaign --hide piston-leakage --strength 8
python docs/figures/discovery.py campaign/calibration.toml
"""

import sys
import tempfile
from pathlib import Path

from rigid import discover
from rigid.io.cli import Options
from rigid.io.runtime import prepare
from rigid.plots.discovery import against_figure
from rigid.plots.vector import svg
from rigid.report.discovery.residuals import against
from rigid.spec import load_spec


def main() -> None:
    """Write discovery.svg beside this file."""
    prepare()
    path = Path(sys.argv[1])
    asked = discover.question(load_spec(path))
    with tempfile.TemporaryDirectory() as folder:
        given = Options(str(path), Path(folder), None, resume=False, quiet=True, as_json=False)
        outcome = discover.answer(asked, given)
    shown = against(outcome.steps[0])
    if shown is None:
        raise SystemExit("no effect of the catalogue was added: there is nothing to draw")
    text = svg(against_figure(shown, simulated=True), "readme-discovery")
    Path(__file__).with_name("discovery.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
