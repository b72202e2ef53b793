"""Face folders made from recipes and the CC0 MakeHuman data."""
