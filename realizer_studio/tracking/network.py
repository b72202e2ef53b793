"""Neural networks for faces, run by ai-edge-litert."""

from __future__ import annotations

import importlib.util
import warnings
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.core.errors import RealizerError

if TYPE_CHECKING:
    from PIL.Image import Image

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

    def __call__(self, picture: Image, low: float = 0.0) -> dict[str, Float32]:
        """Return the outputs by name; `low` is the value of black, white is 1."""
        pixels = np.asarray(picture, np.float32) * np.float32((1 - low) / 255) + np.float32(low)
        self._run.set_tensor(self._input, pixels[None])
        self._run.invoke()
        return {name: self._run.get_tensor(index) for name, index in self._outputs.items()}


@cache
def network(name: str, *inner: str) -> Network:
    """Return a network by its name; it is loaded once."""
    return Network(name, inner)
