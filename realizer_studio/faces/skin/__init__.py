"""The maps of a face's skin, baked by recipe."""
