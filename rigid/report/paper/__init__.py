"""The paper reproduced: page and files."""
