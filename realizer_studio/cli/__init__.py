"""The commands that make and analyse."""
