"""The expression library: built-in and user expressions, search, and timelines."""
