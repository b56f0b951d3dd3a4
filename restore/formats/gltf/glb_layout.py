"""The parts of a glTF 2.0 header that the reader uses, validated."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

# glTF 2.0 specification, "Accessors".
COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MAX_NODES = 256  # one textured mesh has a node or two; an editor adds some dozens


class View(BaseModel):
    """A range of bytes of the binary chunk."""

    buffer: Literal[0] = 0
    start: int = Field(default=0, alias="byteOffset", ge=0)
    length: int = Field(alias="byteLength", ge=1)
    stride: int | None = Field(default=None, alias="byteStride", ge=4, le=252)


class Accessor(BaseModel):
    """Array in a view.

    Without a view it would be zeros from nothing (sparse or compressed data).
    """

    view: int = Field(alias="bufferView", ge=0)
    start: int = Field(default=0, alias="byteOffset", ge=0)
    normalized: bool = False
    component: int = Field(alias="componentType")
    count: int = Field(ge=1)
    kind: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"] = Field(alias="type")

    @property
    def size(self) -> int:
        """Size of the array, bytes."""
        return self.count * COMPONENTS[self.kind] * COMPONENT_BYTES.get(self.component, 4)


class Image(BaseModel):
    """A picture in a view, or elsewhere."""

    view: int | None = Field(default=None, alias="bufferView", ge=0)


class TextureSource(BaseModel):
    """The picture of a texture in a format of its own."""

    source: int | None = Field(default=None, ge=0)


class TextureFormats(BaseModel):
    """The formats of pictures that the reader knows besides PNG and JPEG."""

    webp: TextureSource = Field(default=TextureSource(), alias="EXT_texture_webp")


class Texture(BaseModel):
    """A use of a picture."""

    source: int | None = Field(default=None, ge=0)
    extensions: TextureFormats = TextureFormats()

    @property
    def image(self) -> int | None:
        """The number of its picture, of the plain format where it has both."""
        return self.extensions.webp.source if self.source is None else self.source


class TextureTransform(BaseModel):
    """How the texture coordinates are moved before the picture is read.

    The rotation is in radians.
    """

    model_config = ConfigDict(allow_inf_nan=False)
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)
    texcoord: int | None = Field(default=None, alias="texCoord", ge=0)


class UseExtensions(BaseModel):
    """The extensions of a use of a texture that the reader knows."""

    transform: TextureTransform = Field(default=TextureTransform(), alias="KHR_texture_transform")


class TextureUse(BaseModel):
    """A use of a texture, and the set of texture coordinates that it is for."""

    index: int = Field(ge=0)
    texcoord: int = Field(default=0, alias="texCoord", ge=0)
    extensions: UseExtensions = UseExtensions()


class Shading(BaseModel):
    """The part of a material that carries the picture."""

    base: TextureUse | None = Field(default=None, alias="baseColorTexture")


class Material(BaseModel):
    """A material of faces."""

    shading: Shading = Field(default=Shading(), alias="pbrMetallicRoughness")


class Primitive(BaseModel):
    """A mesh: the arrays of its vertices and of its faces."""

    attributes: dict[str, Annotated[int, Field(ge=0)]]
    indices: int | None = Field(default=None, ge=0)
    material: int | None = Field(default=None, ge=0)

    @property
    def arrays(self) -> list[int]:
        """All arrays that it reads."""
        return [*self.attributes.values(), *([] if self.indices is None else [self.indices])]


class Mesh(BaseModel):
    """Some primitives."""

    primitives: list[Primitive]


class Requirements(BaseModel):
    """The extensions without which a file cannot be read."""

    extensions: list[str] = Field(default=[], alias="extensionsRequired")


class Layout(BaseModel):
    """The parts of a glTF header that are validated before any array is read."""

    views: list[View] = Field(default=[], alias="bufferViews")
    accessors: list[Accessor] = []
    meshes: list[Mesh] = []
    nodes: list[dict[str, Any]] = Field(default=[], max_length=MAX_NODES)
    images: list[Image] = []
    textures: list[Texture] = []
    materials: list[Material] = []
