"""Where simulation and data disagree, and which effect is missing."""
