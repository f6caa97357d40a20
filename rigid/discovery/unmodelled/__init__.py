"""Hidden things that no effect of the catalogue stands for, and their signatures."""
