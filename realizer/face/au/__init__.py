"""The face model by action units: measured displacements in, functions that move any mesh out."""

from realizer.face.au.deformer import Moves, columns, moves_of
from realizer.face.au.file import read_model, write_model
from realizer.face.au.fit import fit_models, table, table_text
from realizer.face.au.limit import runaways
from realizer.face.au.measure import Measured, read_measured, read_shapes, write_shapes
from realizer.face.au.mixers import additive, mix, opened, successive
from realizer.face.au.model import Model

__all__ = [
    "Measured",
    "Model",
    "Moves",
    "additive",
    "columns",
    "fit_models",
    "mix",
    "moves_of",
    "opened",
    "read_measured",
    "read_model",
    "read_shapes",
    "runaways",
    "successive",
    "table",
    "table_text",
    "write_model",
    "write_shapes",
]
