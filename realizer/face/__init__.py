"""Faces: face folders, and the deformers that move their meshes by FAPs or action units."""
