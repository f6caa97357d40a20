"""Which law of friction the records speak for."""
