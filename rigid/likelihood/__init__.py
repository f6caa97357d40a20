"""Uncertain numbers and records to a log-posterior density."""
