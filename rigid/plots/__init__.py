"""Data in, figure out: values of `rigid.plots.shown` become matplotlib figures.

One idea a module. Nothing is computed here, and nothing is imported until a figure is asked for.
"""
