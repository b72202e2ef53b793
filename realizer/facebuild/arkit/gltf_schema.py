"""The parts of glTF 2.0 documents that heads are read from, as a schema."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

Index = Annotated[int, Field(strict=True, ge=0, lt=2**31)]
Number = Annotated[float, Field(strict=True)]  # or infinity or NaN, which are found where vertices are placed
Finite = Annotated[float, Field(strict=True, ge=-1e6, le=1e6)]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Triple = Annotated[list[Number], Field(min_length=3, max_length=3)]
Quadruple = Annotated[list[Number], Field(min_length=4, max_length=4)]
Colour = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Matrix = Annotated[list[Number], Field(min_length=16, max_length=16)]
Component = Literal[5120, 5121, 5122, 5123, 5125, 5126]


class _SparseIndices(BaseModel):
    bufferView: Index
    byteOffset: Index = 0
    componentType: Literal[5121, 5123, 5125]


class _SparseValues(BaseModel):
    bufferView: Index
    byteOffset: Index = 0


class _Sparse(BaseModel):
    count: Index
    indices: _SparseIndices
    values: _SparseValues


class _Accessor(BaseModel):
    bufferView: Index | None = None
    byteOffset: Index = 0
    componentType: Component
    count: Index
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    sparse: _Sparse | None = None


class _Meshopt(BaseModel):
    buffer: Index
    byteOffset: Index = 0
    byteLength: Index
    byteStride: Annotated[int, Field(strict=True, ge=2, le=256, multiple_of=2)]
    count: Index
    mode: Literal["ATTRIBUTES", "TRIANGLES", "INDICES"]
    filter: Literal["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"] = "NONE"


class _ViewExtensions(BaseModel):
    EXT_meshopt_compression: _Meshopt | None = None
    KHR_meshopt_compression: _Meshopt | None = None


class _BufferView(BaseModel):
    buffer: Index = 0
    byteOffset: Index = 0
    byteLength: Index = 0
    byteStride: Index | None = None
    extensions: _ViewExtensions = _ViewExtensions()


class _Buffer(BaseModel):
    uri: str | None = None


class _Image(BaseModel):
    uri: str = ""
    bufferView: Index = 0


class _TextureSource(BaseModel):
    source: Index | None = None


class _TextureSources(BaseModel):
    EXT_texture_webp: _TextureSource = _TextureSource()
    EXT_texture_avif: _TextureSource = _TextureSource()
    KHR_texture_basisu: _TextureSource = _TextureSource()


class _Texture(BaseModel):
    source: Index | None = None
    sampler: Index | None = None
    extensions: _TextureSources = _TextureSources()


class _Sampler(BaseModel):
    wrapS: Literal[10497, 33071, 33648] = 10497
    wrapT: Literal[10497, 33071, 33648] = 10497


class _TextureTransform(BaseModel):
    offset: Pair = [0, 0]
    scale: Pair = [1, 1]
    rotation: Finite = 0
    texCoord: Index = 0


class _TextureExtensions(BaseModel):
    KHR_texture_transform: _TextureTransform = _TextureTransform()


class _TextureInfo(BaseModel):
    index: Index
    texCoord: Index = 0
    scale: Finite = 1
    strength: Finite = 1
    extensions: _TextureExtensions = _TextureExtensions()


class _Surface(BaseModel):
    baseColorFactor: Colour = [1, 1, 1, 1]
    baseColorTexture: _TextureInfo | None = None
    metallicRoughnessTexture: _TextureInfo | None = None
    roughnessFactor: Finite = 1


class _GlossySurface(BaseModel):
    diffuseFactor: Colour = [1, 1, 1, 1]
    diffuseTexture: _TextureInfo | None = None


class _Strength(BaseModel):
    emissiveStrength: Finite = 1


class _Transmission(BaseModel):
    transmissionFactor: Finite = 0


class _MaterialExtensions(BaseModel):
    KHR_materials_pbrSpecularGlossiness: _GlossySurface = _GlossySurface()
    KHR_materials_emissive_strength: _Strength = _Strength()
    KHR_materials_transmission: _Transmission = _Transmission()


class _Material(BaseModel):
    pbrMetallicRoughness: _Surface = _Surface()
    normalTexture: _TextureInfo | None = None
    occlusionTexture: _TextureInfo | None = None
    emissiveTexture: _TextureInfo | None = None
    emissiveFactor: Annotated[list[Finite], Field(min_length=3, max_length=3)] = [0, 0, 0]
    alphaMode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alphaCutoff: Finite = 0.5
    extensions: _MaterialExtensions = _MaterialExtensions()


class _Draco(BaseModel):
    bufferView: Index
    attributes: dict[str, Index]


class _PrimitiveExtensions(BaseModel):
    KHR_draco_mesh_compression: _Draco | None = None


class _Primitive(BaseModel):
    attributes: dict[str, Index] = {}
    indices: Index = 0
    material: Index = 0
    mode: Index = 4
    targets: list[dict[str, Index]] = []
    extensions: _PrimitiveExtensions = _PrimitiveExtensions()


class _Mesh(BaseModel):
    primitives: list[_Primitive] = []


class _Node(BaseModel):
    children: list[Index] = []
    mesh: Index = 0
    skin: Index = 0
    matrix: Matrix = [0] * 16
    rotation: Quadruple = [0, 0, 0, 1]
    scale: Triple = [1, 1, 1]
    translation: Triple = [0, 0, 0]


class _Skin(BaseModel):
    joints: list[Index] = []
    inverseBindMatrices: Index = 0


class _Scene(BaseModel):
    nodes: list[Index] = []


class _Document(BaseModel):
    asset: dict[str, Any]
    extensionsRequired: list[str] = []
    scene: Index = 0
    scenes: list[_Scene] = []
    nodes: list[_Node] = []
    meshes: list[_Mesh] = []
    skins: list[_Skin] = []
    materials: list[_Material] = []
    textures: list[_Texture] = []
    samplers: list[_Sampler] = []
    images: list[_Image] = []
    accessors: list[_Accessor] = []
    bufferViews: list[_BufferView] = []
    buffers: list[_Buffer] = []


def document_fault(document: Any) -> str:
    """Return the first place of a document that is not glTF, with what was wanted and what came, or ""."""
    try:
        _Document.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        steps = (f"[{step}]" if isinstance(step, int) else f".{step}" for step in first["loc"])
        place = "".join(steps).removeprefix(".") or "document"
        wanted = first["msg"].replace("Input should be", "wanted").replace("Field required", "wanted a value")
        wanted = wanted.replace("List should have", "wanted").replace(" after validation", "")
        try:
            got = repr(first["input"])[:80]
        except ValueError:
            got = "a number of thousands of digits"
        return f"{place}: {wanted}, got {got}"
    return ""
