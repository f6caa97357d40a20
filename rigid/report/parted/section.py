"""The section on the record that parts two effects: what it is on the page."""

from rigid.report.parted import figures
from rigid.report.section import Kind

KIND = Kind(
    "plan-between", 46, "The record that tells two effects apart", "parted.html.j2", figures
)
