"""From what size on residuals forbid the use of a result, the same for all commands."""

MOST_GAP = 1.5
"""Residuals that are half as large again as the sheets say, over all records, are no fit."""

MOST_CHANNEL_GAP = 2.5
