"""The output .vrma: a VRM animation of preset expressions, head and gaze, for any VRM avatar."""

from functools import cache
from itertools import combinations
from typing import Any

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.animation.axis import AU_NAMES, au
from realizer.core.array_types import Float32, Float64
from realizer.face.glb_file import GlbFile, quaternions
from realizer.outputs.output import Output
from realizer.realization import Realization
from realizer.tables import toml_table
from realizer.tables.lexemes import face_lexemes

EXTENSION, VERSION = "VRMC_vrm_animation", "1.0"
BLINKS = {"blinkLeft": "eyeBlinkLeft", "blinkRight": "eyeBlinkRight"}
# Action units of speaking lips, which are ignored in expressions.
LIPS = {25, 26, 27}


def encode_vrma(realization: Realization) -> bytes:
    """Return a glTF 2.0 file of a skeleton at rest and an animation, frame k at k / fps.

    The weight of an expression is the first coordinate of a node's translation; the head rotates as a bone,
    the gaze as a node of its own. VRM has the same axes as our faces.
    """
    frames = arkit(realization.aus, realization.mapping)
    file = GlbFile()
    clock = file.add(frames.times.astype(np.float32), bounds=True)
    nodes, bones = _skeleton()
    keys: list[tuple[int, str, Float32]] = [
        (bones["head"], "rotation", quaternions(frames.head[:, [1, 0, 2]]))
    ]
    presets = {}
    for name, weights in expressions(realization).items():
        presets[name] = {"node": len(nodes)}
        keys.append((len(nodes), "translation", np.pad(weights[:, None], ((0, 0), (0, 2)))))
        nodes.append({"name": name})
    gaze = np.pad(frames.eyes.mean(axis=1)[:, ::-1], ((0, 0), (0, 1)))
    keys.append((len(nodes), "rotation", quaternions(gaze)))
    look = {"node": len(nodes), "offsetFromHeadBone": [0.0, 0.06, 0.0]}
    nodes.append({"name": "lookAt"})
    return file.bytes_of(
        {
            "asset": {"version": "2.0", "generator": "bml-realizer"},
            "extensionsUsed": [EXTENSION],
            "scene": 0,
            "scenes": [{"nodes": [bones["hips"], *range(len(bones), len(nodes))]}],
            "nodes": nodes,
            "animations": [file.animation("performance", clock, keys)],
            "extensions": {
                EXTENSION: {
                    "specVersion": VERSION,
                    "humanoid": {"humanBones": {name: {"node": node} for name, node in bones.items()}},
                    "expressions": {"preset": presets},
                    "lookAt": look,
                }
            },
        }
    )


def expressions(realization: Realization) -> dict[str, Float32]:
    """Return the weights, (n,) float32 0..1, of VRM's preset expressions for the first character, by name.

    Vowels come from visemes, blinks from ARKit's shapes, and emotions are the mixture of their faces that is
    nearest to the action units, by non-negative least squares.
    """
    visemes = realization.visemes()
    blinks = arkit(realization.aus, realization.mapping).weights
    found: dict[str, Any] = {
        name: visemes[:, list(map(int, parts))] @ list(parts.values())
        for name, parts in _table()["mouth"].items()
    }
    found |= {name: blinks[:, ARKIT_NAMES().index(shape)] for name, shape in BLINKS.items()}
    found |= dict(zip(_faces()[0], _mixture(realization.aus.aus).T, strict=True))
    return {name: np.clip(weights, 0, 1).astype(np.float32) for name, weights in found.items()}


def _mixture(shown: Float32) -> Float64:
    """Return the parts (n, k) of the faces, by trying all subsets of these few."""
    _, faces = _faces()
    best = np.zeros((len(shown), len(faces)))
    least = np.square(shown * faces.any(axis=0)).sum(axis=1).astype(np.float64)
    for count in range(1, len(faces) + 1):
        for chosen in combinations(range(len(faces)), count):
            subset = faces[list(chosen)]
            parts = shown @ np.linalg.pinv(subset)
            left = np.square((shown - parts @ subset) * faces.any(axis=0)).sum(axis=1)
            better = (parts >= 0).all(axis=1) & (left < least - 1e-9)
            least[better] = left[better]
            best[better] = 0
            best[np.ix_(better, chosen)] = parts[better]
    return best


@cache
def _faces() -> tuple[tuple[str, ...], Float64]:
    """Return the names of the faces, and their action units (k, n_aus)."""
    names = _table()["face"]
    faces = np.zeros((len(names), len(AU_NAMES())))
    for row, lexeme in zip(faces, names.values(), strict=True):
        for (unit, side), amount in face_lexemes()[lexeme].aus.items():
            if unit not in LIPS:
                row[[target.column for target in au(unit, side)]] = min(amount, 1.0)
    return tuple(names), faces


def _skeleton() -> tuple[list[dict[str, Any]], dict[str, int]]:
    bones = _table()["bones"]
    numbers = {name: k for k, name in enumerate(bones)}
    nodes: list[dict[str, Any]] = [{"name": name, "translation": bone["at"]} for name, bone in bones.items()]
    for name, bone in bones.items():
        if "parent" in bone:
            nodes[numbers[bone["parent"]]].setdefault("children", []).append(numbers[name])
    return nodes, numbers


@cache
def _table() -> dict[str, Any]:
    return toml_table("vrm.toml")


VRMA = Output(
    ".vrma",
    "model/gltf-binary",
    "expressions, head and gaze for VRM avatars",
    lambda realization, _: encode_vrma(realization),
)
