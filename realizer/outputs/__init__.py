"""Encodings of a realization, which `registry` lists."""
