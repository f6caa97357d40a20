"""The section on a calibration: what it is on the page."""

from rigid.report.calibration import figures
from rigid.report.section import Kind

KIND = Kind("calibration", 10, "Calibration", "calibration.html.j2", figures)
