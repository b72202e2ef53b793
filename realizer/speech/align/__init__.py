"""A recording and what it says in, when it says each word and phoneme out."""
