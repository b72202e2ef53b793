"""FAP rows become pictures: light, cameras, a canvas in a process of its own, contact sheets."""

from realizer.render.process import Renderer, available

__all__ = ["Renderer", "available"]
