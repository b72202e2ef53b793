"""Analysis of recordings and pictures of faces."""
