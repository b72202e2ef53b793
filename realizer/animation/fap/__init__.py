"""MPEG-4 FAP frames, from action units and from files."""
