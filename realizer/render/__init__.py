"""Rendering: light, cameras, drawing in a process of its own, contact sheets."""
