"""Bands of field tests: files, terminal, page."""
