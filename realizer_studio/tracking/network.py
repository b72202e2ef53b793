"""Neural networks for faces, run by ai-edge-litert, and the squares of pictures that are their inputs."""

from __future__ import annotations

import importlib.util
import math
import warnings
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from realizer.core.array_types import Float32, Float64
from realizer.core.errors import RealizerError

FOLDER = Path(__file__).with_name("models")
INSTALL = "finding faces in pictures needs ai-edge-litert: pip install 'bml-realizer[track]'"


class TrackingError(RealizerError):
    """Pictures cannot be tracked; the message names the file and a remedy."""


class Network:
    """A network with one picture as input, whose inner layers can be read too.

    Attributes:
        size: width and height of the input in pixels.
    """

    def __init__(self, name: str, inner_layers: tuple[str, ...] = ()) -> None:
        """Load `name`.tflite from `models`; `inner_layers` names tensors to return with the outputs.

        Raises:
            RealizerError: ai-edge-litert is not installed.
        """
        if importlib.util.find_spec("ai_edge_litert") is None:
            raise RealizerError(INSTALL)
        from ai_edge_litert.interpreter import Interpreter

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about the memory for inner layers
            self._run: Any = Interpreter(
                str(FOLDER / f"{name}.tflite"),
                num_threads=1,
                experimental_preserve_all_tensors=bool(inner_layers),
            )
        self._run.allocate_tensors()
        self._input = self._run.get_input_details()[0]["index"]
        self._outputs = {row["name"]: row["index"] for row in self._run.get_output_details()}
        self._outputs |= {
            r["name"]: r["index"] for r in self._run.get_tensor_details() if r["name"] in inner_layers
        }
        self.size = int(self._run.get_input_details()[0]["shape"][1])

    def __call__(self, picture: Image.Image, low: float = 0.0) -> dict[str, Float32]:
        """Return the outputs by name; `low` is the value of black, white is 1."""
        pixels = np.asarray(picture, np.float32) * np.float32((1 - low) / 255) + np.float32(low)
        self._run.set_tensor(self._input, pixels[None])
        self._run.invoke()
        return {name: self._run.get_tensor(index) for name, index in self._outputs.items()}


@cache
def network(name: str, *inner: str) -> Network:
    """Return a network by its name; it is loaded once."""
    return Network(name, inner)


@dataclass(frozen=True, slots=True)
class Region:
    """A square in a picture."""

    x: float  # its centre in pixels from the top left corner
    y: float  # its centre in pixels from the top left corner
    side: float  # its length in pixels
    angle: float = 0.0  # radians by which it is turned clockwise
    mirrored: bool = False  # whether the network gets its mirror image

    @classmethod
    def around(cls, points: Any, left: Any, right: Any, scale: float) -> Region:
        """Return the region around points (n, 2) whose upper edge is parallel to the line from left to right.

        Args:
            left, right: (2,) pixels, in the order of the picture.
            scale: the side, relative to the longer side of the rotated bounding box of the points.
        """
        angle = math.atan2(right[1] - left[1], right[0] - left[0])
        upright = np.asarray(points, np.float64) @ _turn(angle)
        low, high = upright.min(axis=0), upright.max(axis=0)
        x, y = _turn(angle) @ ((low + high) / 2)
        return cls(float(x), float(y), float((high - low).max()) * scale, angle)

    def cut(self, picture: Image.Image, pixels: int) -> Image.Image:
        """Return the square as an upright picture, black outside the original picture."""
        factor = max(1, int(self.side / pixels / 1.5))
        centre = np.array([self.x, self.y])
        if factor > 1:  # against aliasing
            reach = self.side / 2 * (abs(math.cos(self.angle)) + abs(math.sin(self.angle))) + factor
            left, top, right, bottom = (
                int(v) for v in (*np.maximum(centre - reach, 0), *(centre + reach + 1))
            )
            box = left, top, min(right, picture.width), min(bottom, picture.height)
            if box[0] < box[2] and box[1] < box[3]:
                picture, centre = picture.reduce(factor, box), centre - (left, top)
        (a, b), (c, d) = self._axes() * (self.side / pixels / factor)
        x, y = centre / factor - np.array([a + b, c + d]) * (pixels / 2)
        numbers = tuple(map(float, (a, b, x, c, d, y)))
        return picture.transform((pixels, pixels), Image.Transform.AFFINE, numbers, Image.Resampling.BILINEAR)

    def to_picture(self, points: Any) -> Float64:
        """Return points (n, 2 or 3) of the square, 0..1, in pixels of the picture; depths are scaled too."""
        points = np.asarray(points, np.float64)
        pixels: Float64 = points * self.side
        pixels[:, :2] = (points[:, :2] - 0.5) @ (self._axes() * self.side).T + (self.x, self.y)
        return pixels

    def _axes(self) -> Float64:
        """Return the directions of the square's axes as columns."""
        return _turn(self.angle) * ((-1.0 if self.mirrored else 1.0), 1.0)


def _turn(angle: float) -> Float64:
    """Return the matrix of a clockwise rotation, with y down."""
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
