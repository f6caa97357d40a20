"""The result of discovery: files, terminal, page."""
