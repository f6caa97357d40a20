"""Hidden things that no effect of the catalogue stands for, and the traces they would leave."""
