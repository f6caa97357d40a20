"""Make the figures of docs/paper.md: the stories of the paper's numbers, Figs. 4, 8 and 9.

python docs/figures/paper.py
"""

from pathlib import Path

from rigid.io.runtime import prepare


def main() -> None:
    """Write paper-*.svg beside this file."""
    prepare()
    from rigid.plots.vector import svg
    from rigid.published.run import run
    from rigid.report.gallery import drawn
    from rigid.report.published import figures
    from rigid.report.published.present import content
    from rigid.spec import find_spec, load_spec

    spec = load_spec(find_spec("paper"))
    told = content(spec, run(spec, spec.sampler.seed))
    for _, one in drawn(figures, told):
        path = Path(__file__).with_name(f"paper-{one.name}.svg")
        path.write_text(svg(one.figure, f"paper-{one.name}"), encoding="utf-8")


if __name__ == "__main__":
    main()
