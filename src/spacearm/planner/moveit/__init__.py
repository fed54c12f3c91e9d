"""MoveIt's planning scenes and motion requests, read as they are."""
