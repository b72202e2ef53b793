"""What feelings look like: words and places on the wheel in, ranges of FAPs out, and back."""
