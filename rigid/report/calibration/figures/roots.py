"""Roots of equation (14) in the complex plane, as in Fig. 4 of the paper."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Complex
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.shown import Roots
from rigid.plots.style import BLUE, GREY, PRINTED, RED, house_style, new_figure
from rigid.report.content import CalibrationContent

PLACE = "friction"

_HEIGHT = 4.2
# Roots far up the imaginary axis would flatten the rest; the paper leaves them out as well.
_HIGHEST = 3.0


def drawn(content: CalibrationContent) -> Iterator[Drawn]:
    """The figure, where a record is of the rig."""
    roots = content.roots
    if roots is None:
        return
    yield Drawn(
        "roots",
        roots_figure(roots, content.simulated),
        "Roots of equation (14) in the complex plane, as in Fig. 4 of the paper: grey paths as the "
        "damping grows, circles without damping, marks at the values of the friction coefficient "
        "named. A root on the imaginary axis does not oscillate.",
        "Roots of the characteristic equation in the complex plane",
        numbers(roots),
    )


def numbers(roots: Roots) -> Columns:
    """Real and imaginary parts of all that is drawn."""
    listed = {"undamped": roots.undamped} | dict(roots.marks)
    if roots.posterior is not None:
        listed["posterior"] = roots.posterior[1]
    listed |= {f"path {i}": path for i, path in enumerate(_followed(roots.paths), start=1)}
    return {
        f"{part} y, {name} [1]": take(values)
        for name, values in listed.items()
        for part, take in (("Re", np.real), ("Im", np.imag))
    }


def roots_figure(roots: Roots, simulated: bool) -> Figure:
    """Paths of the roots as the damping grows, with the published and the found ones."""
    with house_style():
        figure = new_figure(_HEIGHT, simulated)
        axes = figure.add_subplot()
        low, high = roots.damping_range
        label = rf"damping $\varepsilon$ from {low:.3g} to {high:.3g}"
        paths = _followed(roots.paths)
        for path in paths:
            axes.plot(np.real(path), np.imag(path), color=GREY, linewidth=0.9, label=label)
            label = None
        if roots.posterior is not None:
            name, cloud = roots.posterior
            axes.plot(
                *(np.real(cloud), np.imag(cloud), "."),
                color=BLUE,
                markersize=4,
                alpha=0.6,
                zorder=4,
                rasterized=cloud.size > 1000,
                label=name,
            )
        axes.plot(
            *(np.real(roots.undamped), np.imag(roots.undamped), "o"),
            color=BLUE,
            markerfacecolor="white",
            markersize=7,
            label="no damping",
        )
        for marker, (name, values) in zip(PRINTED, roots.marks, strict=False):
            axes.plot(
                *(np.real(values), np.imag(values), marker),
                color=RED,
                markersize=5,
                label=name,
            )
        axes.axhline(0, color=GREY, linewidth=0.5, zorder=0)
        axes.axvline(0, color=GREY, linewidth=0.5, zorder=0)
        reach = 1.15 * float(np.abs(np.real(roots.paths)).max())
        axes.set(xlim=(-reach, reach), ylim=(-0.08, min(_HIGHEST, _top(roots))))
        axes.set(xlabel="Re y = Re ω / ω₀ [1]", ylabel="Im y = Im ω / ω₀ [1]")
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def _followed(paths: Complex[np.ndarray, "roots m"]) -> Complex[np.ndarray, "roots m"]:
    """The paths with each root joined to the nearest one of the step before, in any order given."""
    rows = [list(paths[:, 0])]
    for step in paths.T[1:]:
        left = list(step)
        rows.append([left.pop(int(np.abs(np.array(left) - root).argmin())) for root in rows[-1]])
    return np.array(rows).T


def _top(roots: Roots) -> float:
    return 1.1 * float(np.imag(roots.paths).max()) + 0.05
