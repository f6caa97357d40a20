"""Ways to a trajectory: an exponential integrator, and diffrax as the reference for it."""
