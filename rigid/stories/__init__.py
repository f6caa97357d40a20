"""What the numbers that a paper prints say of a rig: stories, their posteriors and evidence."""
