"""Heads that FAPs and action units move: a face folder in, vertices out."""

from realizer.face.check import check_face
from realizer.face.deform import deform
from realizer.face.glb import to_glb
from realizer.face.load import FaceInfo, face_name, list_faces, load_face, takes
from realizer.face.model import Face, Fapu
from realizer.face.surface import face_scale, normals, quantise

__all__ = [
    "Face",
    "FaceInfo",
    "Fapu",
    "check_face",
    "deform",
    "face_name",
    "face_scale",
    "list_faces",
    "load_face",
    "normals",
    "quantise",
    "takes",
    "to_glb",
]
