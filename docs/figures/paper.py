"""Make the figures of docs/paper.md: the stories of the paper's numbers, Figs. 4, 8 and 9.

python docs/figures/paper.py
"""

from pathlib import Path

from rigid.io.runtime import prepare


def main() -> None:
    """Write paper-*.svg beside this file."""
    prepare()
    from rigid.plots import stories as plots
    from rigid.plots.vector import svg
    from rigid.published.run import run
    from rigid.report.published.present import shown
    from rigid.spec import find_spec, load_spec

    spec = load_spec(find_spec("paper"))
    seen = shown(spec, run(spec, spec.sampler.seed, print))
    figures = {
        "evidence": plots.evidence_figure(seen),
        "roots": plots.roots_figure(seen),
        "release": plots.release_figure(seen),
        "running": plots.running_figure(seen),
    }
    for name, figure in figures.items():
        path = Path(__file__).with_name(f"paper-{name}.svg")
        path.write_text(svg(figure, f"paper-{name}"), encoding="utf-8")


if __name__ == "__main__":
    main()
