"""The figures of the section on a calibration, each with caption and alternative text."""

import re
from collections.abc import Iterator

from rigid.plots.illustration import Illustration
from rigid.plots.vector import svg
from rigid.report.content import CalibrationContent, ChannelFit

_BANDS = "Bands hold 50 and 90 % of the posterior."


def _key(*words: str) -> str:
    return "-".join(["fig", *(re.sub(r"[^A-Za-z0-9]+", "-", word) for word in words)])


def friction(content: CalibrationContent) -> Illustration | None:
    """Friction over frequency, if the content has it."""
    from rigid.plots.friction import friction_figure

    if content.friction is None:
        return None
    key = _key("friction")
    caption = (
        f"Friction coefficient over frequency. {_BANDS} Dashed: 90 % of the prior. "
        "Hatched: the records say nothing there, the band is the prior's. "
        "Bars below: frequencies the records excite. Red: values the paper gives."
    )
    alt = "Magnitude, dissipative and storage part of the friction coefficient from 0.01 to 1000 Hz"
    drawing = svg(friction_figure(content.friction, content.simulated), key)
    return Illustration(key, drawing, caption, alt)


def roots(content: CalibrationContent) -> Illustration | None:
    """Roots of equation (14), if the content has them."""
    from rigid.plots.roots import roots_figure

    if content.roots is None:
        return None
    key = _key("roots")
    caption = (
        "Roots of equation (14) in the complex plane, as in Fig. 4 of the paper: "
        "grey paths as the damping grows, circles without damping, marks at the values of "
        "the friction coefficient named. A root on the imaginary axis does not oscillate."
    )
    drawing = svg(roots_figure(content.roots, content.simulated), key)
    return Illustration(key, drawing, caption, "Roots of the characteristic equation")


def records(content: CalibrationContent) -> Iterator[Illustration]:
    """One figure a record and cylinder, in the order of the content."""
    from rigid.plots.fits import record_figure

    groups: dict[tuple[str, str], list[ChannelFit]] = {}
    for channel in content.fits:
        groups.setdefault((channel.record, channel.cylinder), []).append(channel)
    for (record, cylinder), channels in groups.items():
        key = _key(record, cylinder)
        quantities = ", ".join(channel.quantity for channel in channels)
        caption = (
            f"Record {record}, cylinder {cylinder} ({channels[0].kind}). Above: readings and "
            f"what the posterior says the sensors should read. {_BANDS} Below: residual one "
            "step ahead in standard deviations of the fitted noise; grey: ± 2."
        )
        alt = f"Readings, posterior prediction and residuals of {quantities}, record {record}"
        drawing = svg(record_figure(channels, content.simulated), key)
        yield Illustration(key, drawing, caption, alt)


def pairs(content: CalibrationContent) -> Illustration | None:
    """The corner figure, if the content has draws."""
    from rigid.plots.corner import corner_figure

    if content.draws is None:
        return None
    key = _key("corner")
    caption = (
        "Every pair of the main parameters. Contours hold 50 and 90 % of the draws. "
        "Red lines: values the paper gives, where they fall inside the panel. A slanted or "
        "curved contour is a trade-off that the records do not settle."
    )
    drawing = svg(corner_figure(content.draws, content.simulated), key)
    return Illustration(key, drawing, caption, "Joint posterior of pairs of parameters")


def traces(content: CalibrationContent) -> Illustration | None:
    """Traces and ranks, if the content has them."""
    from rigid.plots.traces import trace_figure

    if not content.traces:
        return None
    key = _key("traces")
    caption = (
        "One colour an ensemble. Left of each pair: mean over the walkers at each step; "
        "grey: discarded, and cut off where far away. Right: where the draws of each ensemble "
        "rank among all draws; ensembles that sample the same law lie around the dashed line."
    )
    drawing = svg(trace_figure(content.traces, content.simulated), key)
    return Illustration(key, drawing, caption, "Ensemble means over steps and rank histograms")
