"""Heads from two photographs: landmarks, the recipe that fits them, a smooth warp, and the skin's colours."""
