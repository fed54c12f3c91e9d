"""One script a library, each run by `compare_swarms.py` in an environment of that library's own."""
