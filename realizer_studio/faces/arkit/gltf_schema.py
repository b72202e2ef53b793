"""The schema of the parts of glTF 2.0 documents from which heads are read."""

from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, create_model

Index = Annotated[int, Field(strict=True, ge=0, lt=2**31)]
Number = Annotated[float, Field(strict=True)]  # or infinity or NaN, which are found where vertices are placed
Finite = Annotated[float, Field(strict=True, ge=-1e6, le=1e6)]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Triple = Annotated[list[Number], Field(min_length=3, max_length=3)]
Quadruple = Annotated[list[Number], Field(min_length=4, max_length=4)]
Colour = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Matrix = Annotated[list[Number], Field(min_length=16, max_length=16)]
Component = Literal[5120, 5121, 5122, 5123, 5125, 5126]


def _object(name: str, needed: str = "", **members: Any) -> Any:
    """Return the schema of an object with the kinds of its members; `needed` names the required ones."""
    rows = {key: (kind, ... if key in needed.split() else None) for key, kind in members.items()}
    return create_model(f"_{name}", **rows)  # type: ignore[call-overload]


def _rows(kind: Any) -> Any:
    """Return the schema of a list."""
    return GenericAlias(list, (kind,))


_SparseIndices = _object(
    "SparseIndices", "bufferView componentType", bufferView=Index, byteOffset=Index,
    componentType=Literal[5121, 5123, 5125],
)  # fmt: skip
_SparseValues = _object("SparseValues", "bufferView", bufferView=Index, byteOffset=Index)
_Sparse = _object("Sparse", "count indices values", count=Index, indices=_SparseIndices, values=_SparseValues)
_Accessor = _object(
    "Accessor", "componentType count type", bufferView=Index | None, byteOffset=Index,
    componentType=Component, count=Index,
    type=Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"], sparse=_Sparse | None,
)  # fmt: skip
_Meshopt = _object(
    "Meshopt", "buffer byteLength byteStride count mode", buffer=Index, byteOffset=Index, byteLength=Index,
    byteStride=Annotated[int, Field(strict=True, ge=2, le=256, multiple_of=2)], count=Index,
    mode=Literal["ATTRIBUTES", "TRIANGLES", "INDICES"],
    filter=Literal["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"],
)  # fmt: skip
_ViewExtensions = _object(
    "ViewExtensions", EXT_meshopt_compression=_Meshopt | None, KHR_meshopt_compression=_Meshopt | None,
)  # fmt: skip
_BufferView = _object(
    "BufferView", buffer=Index, byteOffset=Index, byteLength=Index, byteStride=Index | None,
    extensions=_ViewExtensions,
)  # fmt: skip
_Buffer = _object("Buffer", uri=str | None)
_Image = _object("Image", uri=str, bufferView=Index)
_TextureSource = _object("TextureSource", source=Index | None)
_TextureSources = _object(
    "TextureSources", EXT_texture_webp=_TextureSource, EXT_texture_avif=_TextureSource,
    KHR_texture_basisu=_TextureSource,
)  # fmt: skip
_Texture = _object("Texture", source=Index | None, sampler=Index | None, extensions=_TextureSources)
_Sampler = _object("Sampler", wrapS=Literal[10497, 33071, 33648], wrapT=Literal[10497, 33071, 33648])
_TextureTransform = _object("TextureTransform", offset=Pair, scale=Pair, rotation=Finite, texCoord=Index)
_TextureExtensions = _object("TextureExtensions", KHR_texture_transform=_TextureTransform)
_TextureInfo = _object(
    "TextureInfo", "index", index=Index, texCoord=Index, scale=Finite, strength=Finite,
    extensions=_TextureExtensions,
)  # fmt: skip
_Surface = _object(
    "Surface", baseColorFactor=Colour, baseColorTexture=_TextureInfo | None,
    metallicRoughnessTexture=_TextureInfo | None, roughnessFactor=Finite,
)  # fmt: skip
_GlossySurface = _object("GlossySurface", diffuseFactor=Colour, diffuseTexture=_TextureInfo | None)
_Strength = _object("Strength", emissiveStrength=Finite)
_Transmission = _object("Transmission", transmissionFactor=Finite)
_MaterialExtensions = _object(
    "MaterialExtensions", KHR_materials_pbrSpecularGlossiness=_GlossySurface,
    KHR_materials_emissive_strength=_Strength, KHR_materials_transmission=_Transmission,
)  # fmt: skip
_Material = _object(
    "Material", pbrMetallicRoughness=_Surface, normalTexture=_TextureInfo | None,
    occlusionTexture=_TextureInfo | None, emissiveTexture=_TextureInfo | None,
    emissiveFactor=Annotated[list[Finite], Field(min_length=3, max_length=3)],
    alphaMode=Literal["OPAQUE", "MASK", "BLEND"], alphaCutoff=Finite, extensions=_MaterialExtensions,
)  # fmt: skip
_Draco = _object("Draco", "bufferView attributes", bufferView=Index, attributes=dict[str, Index])
_PrimitiveExtensions = _object("PrimitiveExtensions", KHR_draco_mesh_compression=_Draco | None)
_Primitive = _object(
    "Primitive", attributes=dict[str, Index], indices=Index, material=Index, mode=Index,
    targets=list[dict[str, Index]], extensions=_PrimitiveExtensions,
)  # fmt: skip
_Mesh = _object("Mesh", primitives=_rows(_Primitive))
_Node = _object(
    "Node", children=list[Index], mesh=Index, skin=Index, matrix=Matrix, rotation=Quadruple, scale=Triple,
    translation=Triple,
)  # fmt: skip
_Skin = _object("Skin", joints=list[Index], inverseBindMatrices=Index)
_Scene = _object("Scene", nodes=list[Index])
_Document = _object(
    "Document", "asset", asset=dict[str, Any], extensionsRequired=list[str], scene=Index,
    scenes=_rows(_Scene), nodes=_rows(_Node), meshes=_rows(_Mesh), skins=_rows(_Skin),
    materials=_rows(_Material), textures=_rows(_Texture), samplers=_rows(_Sampler), images=_rows(_Image),
    accessors=_rows(_Accessor), bufferViews=_rows(_BufferView), buffers=_rows(_Buffer),
)  # fmt: skip


def document_fault(document: Any) -> str:
    """Return a sentence about the first fault of a document, or "" if it is valid."""
    try:
        _Document.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        steps = (f"[{step}]" if isinstance(step, int) else f".{step}" for step in first["loc"])
        path = "".join(steps).removeprefix(".") or "document"
        expected = (
            first["msg"].replace("Input should be", "wanted").replace("Field required", "wanted a value")
        )
        expected = expected.replace("List should have", "wanted").replace(" after validation", "")
        try:
            got = repr(first["input"])[:80]
        except ValueError:
            got = "a number of thousands of digits"
        return f"{path}: {expected}, got {got}"
    return ""
