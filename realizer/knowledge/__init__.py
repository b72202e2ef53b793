"""Wojdel's knowledge of expressions in conversation (2005, chapter 6): advice and enrichment."""
