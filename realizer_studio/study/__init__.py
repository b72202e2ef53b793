"""Studies with judges: kits of pictures and films, and the analysis of answers."""
