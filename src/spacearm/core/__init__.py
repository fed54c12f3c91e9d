"""The ground floor: errors, checks, records, files, rotations, and the native kernel."""
