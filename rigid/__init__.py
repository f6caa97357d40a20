"""Bayesian parameter identification for hydraulic test rigs.

The package stays lazy: importing `rigid` loads nothing heavy, so that a command can print its
first line before JAX is there.
"""

__version__ = "0.1.0"
