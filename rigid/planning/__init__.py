"""Which record to take next: what each would tell of a quantity, before it is taken."""
