"""The section on the record that parts two effects."""
