"""Voices: text with marks to sound, with the times of words, phonemes and marks.

What is here is loaded when it is first used: the values alone start no engine and read no table.
"""
