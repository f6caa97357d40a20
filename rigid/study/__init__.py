"""A spec with its records as one object, of which the commands are callers."""
