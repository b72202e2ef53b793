"""Speech that clients send in chunks, and their sound clips."""
