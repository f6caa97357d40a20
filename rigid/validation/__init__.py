"""Simulation-based calibration: campaigns drawn from a spec, fitted, and ranked."""
