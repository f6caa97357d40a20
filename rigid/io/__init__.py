"""Files, commands and settings: what has nothing to do with rigs."""
