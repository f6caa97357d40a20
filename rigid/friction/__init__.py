"""Which friction model the records speak for."""
