"""Runs side by side: what moved, what disagrees, what differs."""
