"""FAP rows become pictures: light, cameras, an offscreen canvas in a process of its own, and contact sheets."""

from realizer.render.process import Renderer, available

__all__ = ["Renderer", "available"]
