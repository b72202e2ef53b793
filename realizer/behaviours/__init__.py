"""Behaviours: each module has the elements of one family; `registry` lists them."""
