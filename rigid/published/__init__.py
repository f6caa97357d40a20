"""What the numbers that a paper prints say of a rig: hypotheses, posteriors, evidence."""
