"""The XML schema of a node class: attributes and children, derived from its dataclass fields.

A node class is a few lines::

    @node
    class Wink(Behaviour):
        tag = "{urn:bml-realizer:1}wink"
        sync_points = ("start", "attackPeak", "relax", "end")
        side: str = attribute(one_of("LEFT", "RIGHT"))
        amount: float = attribute(number(0, 1), default=1.0)

`parse(text, {**VOCABULARY, Wink.tag: Wink})` then reads it and `write` writes it: ids, sync points,
descriptions, faults and round trip come with the base class.
"""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, TypeVar, dataclass_transform

from bml_schema.values import Value

_KEY = "bml"
_T = TypeVar("_T")

# A placeholder: to read a reference, the parser needs the ids of the block.
sync_ref = Value("a sync reference", lambda text: text, str, "syncReference")


@dataclass(frozen=True, slots=True)
class Attribute:
    """One XML attribute of a node class.

    `read` is the reader of its value, None for a sync reference, which needs the ids of the block. `old` is
    the name of the attribute in drafts of the standard, or "".
    """

    field: str
    name: str
    value: Value
    required: bool
    default: Any = None
    read: Callable[[str], Any] | None = None
    old: str = ""


@dataclass(frozen=True, slots=True)
class Child:
    """One kind of child elements: the field, the classes, and the allowed and required numbers."""

    field: str
    classes: tuple[type[Any], ...]
    many: bool
    least: int = 0


@dataclass(frozen=True, slots=True)
class NodeSchema:
    """The attributes and children of an element, for the parser and the writer."""

    attributes: Mapping[str, Attribute]  # XML name -> Attribute; `old`: the same by their names in drafts
    old: Mapping[str, Attribute]
    required: tuple[Attribute, ...]
    children: tuple[Child, ...]  # in order of declaration
    # Clark tag -> (Child, class); `by_local`: the same by local name, for documents that put an extension's
    # own children into another namespace.
    by_tag: Mapping[str, tuple[Child, type[Any]]]
    by_local: Mapping[str, tuple[Child, type[Any]]]
    mixed: str = ""  # field of the mixed content (text and children in order), or ""
    text: str = ""  # field of the character data, or ""
    name: str = ""  # local name of the element
    timed: bool = False  # it has sync points, and can have descriptions and unknown attributes and children
    sync_points: tuple[str, ...] = ()

    @property
    def listed(self) -> str:
        """The allowed children as words for a message."""
        tags = [f"<{local(c.tag)}>" for kind in self.children for c in kind.classes] or ["<description>"]
        return ", ".join(tags[:-1]) + f" or {tags[-1]}" if len(tags) > 1 else tags[0]


def attribute(value: Value, *, default: Any = MISSING, name: str = "", old: str = "") -> Any:
    """Declare an XML attribute; without a default it is required.

    Args:
        name: its name in XML, if that is not the field's name in camelCase.
        old: its name in drafts; it is read if the attribute itself is missing, and never written.
    """
    return field(default=default, metadata={_KEY: ("attribute", value, (name, old))})


def child(cls: type[Any], *, default: Any = MISSING) -> Any:
    """Declare one child element; without a default it is required."""
    return field(default=default, metadata={_KEY: ("child", (cls,), default is MISSING)})


def children(*classes: type[Any], least: int = 0, default: Any = MISSING) -> Any:
    """Declare a tuple of child elements of some classes in document order, at least `least` of them."""
    return field(default=default, metadata={_KEY: ("children", classes, least)})


def mixed(*classes: type[Any], default: Any = MISSING) -> Any:
    """Declare mixed content: a tuple of strings and nodes in document order, with whitespace as written."""
    return field(default=default, metadata={_KEY: ("mixed", classes, 0)})


def text(*, default: Any = MISSING) -> Any:
    """Declare the character data of an element without children, with whitespace as written."""
    return field(default=default, metadata={_KEY: ("text", (), 0)})


@dataclass_transform(
    kw_only_default=True,
    frozen_default=True,
    field_specifiers=(attribute, child, children, mixed, text, field),
)
def node(cls: type[_T]) -> type[_T]:
    """Make a class a node class: a frozen dataclass with slots and keyword arguments."""
    return dataclass(frozen=True, slots=True, kw_only=True)(cls)


def local(tag: str) -> str:
    """Return the local name of a Clark tag."""
    return tag.rpartition("}")[2]


def path_below(element: Any, top: Any, path: str) -> str:
    """Return the path of an element inside `top`, whose path is given."""
    steps = ""
    while element is not top:
        parent = element.getparent()
        if parent is None:
            break
        name = local(str(element.tag))
        n = 1 + sum(local(str(e.tag)) == name for e in element.itersiblings(preceding=True))
        steps = f"/{name}[{n}]{steps}"
        element = parent
    return path + steps


def camel(name: str) -> str:
    """Return a name in camelCase: offset_angle -> offsetAngle."""
    head, *tail = name.split("_")
    return head + "".join(t.capitalize() for t in tail)


def schema_of(cls: type[Any]) -> NodeSchema:
    """Return the schema of a node class, derived once from its fields."""
    schema = _SCHEMAS.get(cls)
    if schema is None:
        schema = _SCHEMAS[cls] = _derived(cls)
    return schema


_SCHEMAS: dict[type[Any], NodeSchema] = {}


def _derived(cls: type[Any]) -> NodeSchema:
    attributes: dict[str, Attribute] = {}
    kinds: list[Child] = []
    content = {"mixed": "", "text": ""}
    for f in fields(cls):
        if _KEY not in f.metadata:
            continue
        kind, value, extra = f.metadata[_KEY]
        if kind == "attribute":
            required = f.default is MISSING
            name, old = extra
            xml = name or camel(f.name)
            read = None if value is sync_ref else value.read
            default = None if required else f.default
            attributes[xml] = Attribute(f.name, xml, value, required, default, read, old)
            continue
        if kind in content:
            content[kind] = f.name
        if kind != "text":
            kinds.append(Child(f.name, value, kind != "child", int(extra)))
    by_tag = {c.tag: (k, c) for k in kinds for c in k.classes}
    timed = hasattr(cls, "sync_points")
    return NodeSchema(
        attributes=attributes,
        old={a.old: a for a in attributes.values() if a.old},
        required=tuple(a for a in attributes.values() if a.required),
        children=tuple(kinds),
        by_tag=by_tag,
        by_local={local(tag): entry for tag, entry in by_tag.items()},
        mixed=content["mixed"],
        text=content["text"],
        name=local(getattr(cls, "tag", "")),
        timed=timed,
        sync_points=cls.sync_points if timed else (),
    )
