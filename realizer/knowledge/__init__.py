"""Rules for expressions in conversation (Wojdel 2005, chapter 6): advice and enrichment."""
