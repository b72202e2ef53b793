"""Speech that clients send piece by piece, and their sound clips."""
