"""The rig as equations of motion, its trajectories, what its sensors read, closed forms."""
