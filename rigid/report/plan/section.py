"""The section on the next record: what it is on the page."""

from rigid.report.plan import figures
from rigid.report.section import Kind

KIND = Kind("plan", 45, "The next record", "plan.html.j2", figures)
