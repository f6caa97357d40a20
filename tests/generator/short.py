"""A campaign of three short runs with the parameters of a drawn one, quick to simulate."""

from dataclasses import replace

from rigid.generator.constants import AREA
from rigid.generator.core import Run, Switch
from rigid.generator.draw import Truth, draw
from rigid.generator.pieces import pump_flow

FRAME = Run(
    "frame-1",
    "frame",
    "A",
    1.6,
    (Switch(0.7, "open"), Switch(1.1, "shut"), Switch(1.4, "tank"), Switch(1.6, "shut")),
    kappa=0.27,
    kappa_tank=-0.45,
)
FREE = Run(
    "free-run-1", "free-run", "A", 1.5, (Switch(1.2, "open"), Switch(1.5, "shut")), kappa=0.2
)
RELEASE = Run(
    "release-1", "release", "A", 0.12, (Switch(0.12, "shut"),), preload=6000.0, release_time=0.0302
)
SPEED = 0.2 * pump_flow(0.0) / AREA  # m/s, of the free run once its pressure is steady


def short_truth(seed: int = 7) -> Truth:
    """Give a drawn campaign's rig and sensors with the three runs in place of its own."""
    truth = draw(seed, field=False)
    used = {"load,A", "stroke,A", "pressure,A", "acceleration,A"}
    sensors = {name: sensor for name, sensor in truth.sensors.items() if name in used}
    return replace(truth, runs=(FRAME, FREE, RELEASE), sensors=sensors)
