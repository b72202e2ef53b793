"""Bring your own head: a GLB with ARKit's morph targets in, a face folder out."""
