"""Rendering: light, cameras, drawing in a process of its own, contact sheets."""

from realizer.render.drawing_process import unavailable_reason
from realizer.render.renderer import Renderer

__all__ = ["Renderer", "unavailable_reason"]
