"""SpaceBench: obstacle problems for arms on spacecraft whose base floats, drawn from seeds, each with a known solution."""
