"""Face folders from a recipe and the CC0 MakeHuman data."""
