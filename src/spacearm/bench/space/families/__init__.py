"""The families of problems, a module each."""
