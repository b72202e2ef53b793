"""FAP rows become pictures: light, cameras, a canvas in a process of its own, contact sheets."""

from realizer.render.child import available
from realizer.render.process import Renderer

__all__ = ["Renderer", "available"]
