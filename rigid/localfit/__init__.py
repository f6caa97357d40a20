"""A model refitted around a fit: hypotheses, Newton ascent, evidence, left-out records."""
