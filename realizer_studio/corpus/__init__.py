"""A corpus of recordings of faces: reading, learning, finding and describing expressions (Wojdel 2005)."""
