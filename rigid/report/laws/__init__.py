"""The comparison of friction models: files, terminal, page."""
