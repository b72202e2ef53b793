"""Encodings of a realization: each module has one; `registry` lists them."""
