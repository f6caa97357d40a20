"""The fit of published numbers: files, terminal, page."""
