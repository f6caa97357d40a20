import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rigid.io.errors import InputError
from rigid.records import Record, read_record
from rigid.spec import ChannelSpec, RecordSpec, SensorSpec, Stretch

SHARED = Path(os.environ.get("RIGID_SHARED") or Path(__file__).parents[3] / "shared")
UNITS = {"time": "s", "load": "kN", "stroke": "mm", "pressure": "bar", "acceleration": "g"}
SENSORS = {
    "load": SensorSpec(step=295.0, noise=150.0, gain_sd=1e-3, zero_sd=100.0, range=(-3e5, 3e5)),
    "stroke": SensorSpec(step=2e-4, noise=5e-5, gain_sd=1e-3, zero_sd=1e-4, range=(-0.01, 0.4)),
    "pressure": SensorSpec(step=3e4, noise=1e4, gain_sd=1e-3, zero_sd=2e4, range=(0.0, 7e7)),
    "acceleration": SensorSpec(
        step=0.0, noise=0.35, gain_sd=1e-2, zero_sd=0.05, range=(-2000.0, 2000.0)
    ),
}


class Bench:
    """A folder of records; files are written and read the way a spec would."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.sensors = SENSORS

    def spec(self, file: str, **more) -> RecordSpec:
        channels = more.pop("channels", None) or self.channels("time", "load", "stroke", "pressure")
        given = {"name": "r", "kind": "frame", "cylinder": "A", "fit": True} | more
        position = "shut" if given["kind"] == "release" else "open"
        valve = given.pop("valve", (Stretch(position=position),))
        return RecordSpec(file=self.folder / file, channels=channels, valve=valve, **given)

    def channels(self, *quantities: str) -> dict[str, ChannelSpec]:
        return {q: ChannelSpec(column=q, unit=UNITS[q]) for q in quantities}

    def good(self, samples: int = 400) -> dict[str, np.ndarray]:
        """A loaded frame at 100 Hz, in the units of the file."""
        time = np.arange(samples) * 0.01
        flicker = np.where(np.arange(samples) % 7 == 0, 1.0, 0.0)
        load = 0.295 * (np.floor(400 * time / time[-1]) + flicker)
        return {
            "time": np.round(time, 6),
            "load": np.round(load, 3),
            "stroke": np.round(0.2 * np.floor(20 * time / time[-1]) + 0.2 * flicker, 3),
            "pressure": np.round(0.3 * np.floor(900 * time / time[-1]) + 0.3 * flicker, 3),
        }

    def write(self, file: str, columns: dict[str, np.ndarray]) -> None:
        lines = [",".join(columns)]
        lines += [",".join(f"{v:.10g}" for v in row) for row in zip(*columns.values(), strict=True)]
        self.text(file, "\n".join(lines) + "\n")

    def text(self, file: str, text: str) -> None:
        (self.folder / file).write_text(text, "utf-8")

    def read(self, columns: dict[str, np.ndarray], **more) -> Record:
        self.write("r.csv", columns)
        more.setdefault("channels", self.channels(*columns))
        return read_record(self.spec("r.csv", **more), self.sensors)

    def refusal(self, action: Callable, *arguments, **keywords) -> str:
        with pytest.raises(InputError) as caught:
            action(*arguments, **keywords)
        return str(caught.value)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


@pytest.fixture
def shared() -> Path:
    if not (SHARED / "formats").is_dir():
        pytest.skip(f"no samples of formats in {SHARED}; set RIGID_SHARED")
    return SHARED / "formats"
