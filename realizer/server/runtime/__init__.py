"""Sessions inside event loops and processes."""
