"""Which configurations reach a goal, and why none does."""
