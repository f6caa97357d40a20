"""A test smoothed: loads that nobody knows as latent forces on a known rig or machine."""
