"""Tools that make and analyse faces and corpora. `realizer` finds them by entry points only."""
