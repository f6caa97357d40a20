"""The rig as equations of motion, what its sensors read, and closed forms of the paper."""
