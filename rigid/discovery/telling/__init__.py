"""What was found, for programs, pages and terminals."""
