"""Which record to take next, told: files, terminal, section, figure."""
