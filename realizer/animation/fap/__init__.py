"""MPEG-4 FAP frames: from action units, from files."""
