"""How good the planner is: benchmarks that a user can repeat, with their protocol."""
