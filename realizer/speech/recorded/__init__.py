"""Speech from recordings and clips."""
