"""Painted markers on a face, tracked in films by their colours (Wojdel 2005, 7.1 and 7.2.1)."""
