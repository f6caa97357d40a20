"""The result of a calibration: files, terminal, page."""
