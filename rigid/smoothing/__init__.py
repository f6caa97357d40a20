"""A field record smoothed: the unknown ice load as a latent force on a known rig."""
