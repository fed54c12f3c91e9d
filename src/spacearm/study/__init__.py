"""Studies: tasks in, records out, and the tables and figures that are made of records."""
