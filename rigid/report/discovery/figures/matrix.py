"""What the records can tell apart: cosines between the signatures of all effects."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from rigid.plots.figure import Drawn
from rigid.plots.style import house_style, new_figure
from rigid.report.discovery.section import DiscoveryContent

PLACE = "apart"


def drawn(content: DiscoveryContent) -> Iterator[Drawn]:
    """The figure."""
    yield Drawn(
        "matrix",
        matrix_figure(content.names, content.cosines, content.simulated),
        "What these records can tell apart, before any of them is looked at: the cosine of the "
        "signatures that two effects leave once everything uncertain has absorbed what its prior "
        "lets it. Near 1 or -1, one can pass for the other, unless physics forbids the sign. The "
        "strength of an effect is how many standard deviations of the noise it shows by, in all "
        "records together.",
        "Matrix of cosines between the signatures of all effects",
        {"effect": np.array(content.names)}
        | {name: column for name, column in zip(content.names, content.cosines.T, strict=True)},
    )


def matrix_figure(
    names: Sequence[str], cosines: Float[np.ndarray, "n n"], simulated: bool
) -> Figure:
    """Cosines of the signatures of all effects: 1 and -1 cannot be told apart by size alone."""
    with house_style():
        figure = new_figure(6.4, simulated)
        axes = figure.add_subplot()
        image = axes.imshow(cosines, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
        axes.set_xticks(range(len(names)), names, rotation=90)
        axes.set_yticks(range(len(names)), names)
        axes.tick_params(length=0)
        for i, row in enumerate(cosines):
            for j, value in enumerate(row):
                if i != j and abs(value) >= 0.5:
                    axes.text(
                        j, i, f"{value:.1f}", ha="center", va="center", fontsize=5,
                        color="white" if abs(value) > 0.8 else "black",
                    )  # fmt: skip
        figure.colorbar(image, ax=axes, shrink=0.7, label="cosine of the signatures")
    return figure
