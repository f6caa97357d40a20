"""The section on friction models: what it is on the page."""

from rigid.report.laws import figures
from rigid.report.section import Kind

KIND = Kind("laws", 40, "Friction models", "laws.html.j2", figures)
