"""Voices: text with marks in, sound and the times of words, phonemes and marks out.

What is here is loaded when it is first used: the values alone start no engine and read no table.
"""
