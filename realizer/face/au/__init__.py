"""The face model by action units: measured displacements in, functions that move any mesh out."""

from realizer.face.au.deformer import Deformer, load_deformer
from realizer.face.au.file import read_model, write_model
from realizer.face.au.fit import fit_model, table, table_text
from realizer.face.au.measure import Measured, read_measured, read_shapes, write_shapes
from realizer.face.au.mixers import additive, mix, successive
from realizer.face.au.model import Model

__all__ = [
    "Deformer",
    "Measured",
    "Model",
    "additive",
    "fit_model",
    "load_deformer",
    "mix",
    "read_measured",
    "read_model",
    "read_shapes",
    "successive",
    "table",
    "table_text",
    "write_model",
    "write_shapes",
]
