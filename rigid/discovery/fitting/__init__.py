"""A fit of the model and what could be added to it: programs, samples, slopes, weights."""
