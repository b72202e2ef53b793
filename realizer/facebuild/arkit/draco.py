"""Geometry that is packed by Draco, read by the package DracoPy."""

from typing import Any

from realizer.core.errors import FaceError
from realizer.facebuild.arkit.gltf import Gltf

EXTENSION = "KHR_draco_mesh_compression"
UNDO = "npx @gltf-transform/cli copy HEAD.glb PLAIN.glb"


def unpack_primitive(gltf: Gltf, primitive: dict[str, Any], where: str) -> None:
    """Put what a primitive packs in the place of its accessors.

    Raises:
        FaceError: DracoPy is not installed, or the data are broken.
    """
    packed = primitive.get("extensions", {}).get(EXTENSION)
    if packed is None:
        return
    try:
        import DracoPy
    except ImportError:
        raise FaceError(
            f"{where}: Draco packs its geometry: pip install DracoPy, or undo it: {UNDO}"
        ) from None
    try:
        found = DracoPy.decode(gltf.view(packed.get("bufferView")))
        values = {one["unique_id"]: one["data"] for one in found.attributes}
        for name, number in packed.get("attributes", {}).items():
            gltf.put(primitive["attributes"][name], values[number])
        if "indices" in primitive:
            gltf.put(primitive["indices"], found.faces.reshape(-1, 1))
    except FaceError:
        raise
    except Exception as error:  # DracoPy's own errors have no common class
        raise FaceError(f"{where}: Draco's data are broken ({error}); export the head again") from None
