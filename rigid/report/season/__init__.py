"""The page over a season of tests: the fits of a folder's specs side by side."""
