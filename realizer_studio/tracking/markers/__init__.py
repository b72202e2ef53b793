"""Painted markers on a face, followed in films by their colours (Wojdel 2005, 7.1 and 7.2.1)."""
