"""The page: its contents as values, its template, its style. Computes nothing."""
