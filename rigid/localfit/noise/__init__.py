"""What the noise of residuals is: how it lasts, its tails, jittering instants, its converters."""
