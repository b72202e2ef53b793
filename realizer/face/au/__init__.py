"""The face model by action units (Wojdel 2005, chapter 4)."""
