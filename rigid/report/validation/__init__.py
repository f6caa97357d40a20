"""The section on a validation, and validation.json."""
