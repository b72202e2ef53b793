"""Voices, which convert text with marks to sound and the times of words, phonemes and marks.

Importing a module starts no engine and reads no table.
"""
