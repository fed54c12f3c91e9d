"""Problem and plan files: what they hold, read and written."""
