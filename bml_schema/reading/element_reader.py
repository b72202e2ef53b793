"""A recursive descent reader for the elements of a block: attributes, children, descriptions, constraints.

It raises the first fault as a Fault; the caller decides what is dropped.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Any, cast

from lxml import etree

from bml_schema.behaviours import Speech, SpeechText, Sync
from bml_schema.canonical import MAX_ATTRIBUTES, attributes, canonical
from bml_schema.errors import CUSTOM_ATTRIBUTE_NOT_SUPPORTED, Fault, did_you_mean, quoted
from bml_schema.escape import escape
from bml_schema.node_schema import Attribute, NodeSchema, local, schema_of
from bml_schema.nodes import (
    BMLA,
    BMLT,
    CORE,
    DRAFTS,
    EXTENSIONS,
    LANGUAGE,
    OWN,
    SSML,
    After,
    Before,
    Behaviour,
    Block,
    Constraint,
    Description,
    Required,
    Synchronize,
    bmla,
    core,
    extension,
)
from bml_schema.reading.ssml import described, is_marked_up
from bml_schema.reading.text_reader import read_mixed
from bml_schema.sync_refs import Names, SyncRef, read_sync_ref, respelled
from bml_schema.values import NUMBER, describe_mismatch

Vocabulary = Mapping[str, type[Behaviour]]

_OURS = (f"{{{CORE}}}", f"{{{EXTENSIONS}}}")
_OWN = (*_OURS, f"{{{OWN}}}")  # without BMLA and BMLT, which have more attributes than the schema
_KNOWN = (*_OWN, f"{{{BMLA}}}", f"{{{BMLT}}}")
_PARTS: Mapping[str, type[Synchronize | Before | After]] = {c.tag: c for c in (Synchronize, Before, After)}
_IN_BMLA = f"{{{BMLA}}}"
_SYNC, _DESCRIPTION = Sync.tag, Description.tag
# Elements of the core that are not behaviours.
INNER = {c.tag for c in (Block, Required, Constraint, Description, SpeechText, Sync, *_PARTS.values())}


@lru_cache(maxsize=1000)
def _standard(raw: str) -> tuple[str, str]:
    """Return the core tag of a core or draft element, and the tag of this name in an extension or ""."""
    space, name = raw[1:].split("}") if raw.startswith("{") else ("", raw)
    if space in DRAFTS or not space or space == CORE:
        return core(name), extension(name)
    return raw, bmla(name) if space == BMLT else ""  # some documents confuse them


class ElementReader:
    """Reads elements of one document.

    Attributes:
        vocabulary: Clark tag -> node class.
        names: what references can name; None disables the check.
        lenient: whether other documents than BML 1.0 are read if their meaning is clear.
        remarks: faults that do not drop a behaviour, such as unknown attributes; the caller clears them.
        forgiving: whether attributes with faults are left out, with a remark.
        respelled: times that are written in another way, and how they were read, in words.
    """

    __slots__ = ("forgiving", "lenient", "names", "remarks", "respelled", "vocabulary")

    def __init__(self, vocabulary: Vocabulary, names: Names | None = None, *, lenient: bool = True) -> None:
        self.vocabulary = vocabulary
        self.names = names
        self.lenient = lenient
        self.forgiving = False
        self.remarks: list[Fault] = []
        self.respelled: list[str] = []

    def tag(self, element: etree._Element) -> str:
        """Return the Clark tag; elements without namespace, or of a draft, are core or extension elements."""
        raw: Any = element.tag
        if raw in INNER or raw in self.vocabulary:
            return cast("str", raw)
        known, elsewhere = _standard(raw)
        if elsewhere not in self.vocabulary or known in self.vocabulary:
            return known
        return elsewhere if self.lenient or not elsewhere.startswith(_IN_BMLA) else known

    @property
    def suggest(self) -> Callable[[str, Iterable[str]], str]:
        """The function that returns `, did you mean ...?` for a word and what is known, or ""."""
        return did_you_mean if self.names is None else self.names.suggest

    # element := attributes children

    def node(self, cls: type[Any], element: etree._Element, *, timed: bool = False) -> Any:
        """Read an element as a node of a class; `timed` nodes have an id and sync points."""
        schema = schema_of(cls)
        values = self.attributes(schema, element, timed)
        if schema.mixed:
            values[schema.mixed] = tuple(read_mixed(self, schema, element))
        elif schema.text:
            values[schema.text] = self.text(element)
        elif schema.children or len(element):
            self.children(schema, element, values)
        elif (text := element.text) and not text.isspace():
            self.refuse_text(element)
        node: Any = cls(**values)
        if timed and (fault := node.fault()):
            raise Fault(fault, element)
        return node

    def attributes(self, schema: NodeSchema, element: etree._Element, timed: bool) -> dict[str, Any]:
        """Return attribute values by field; raise one Fault that names all faults."""
        values: dict[str, Any] = {}
        syncs: dict[str, SyncRef] = {}
        foreign: dict[str, str] = {}
        faults: list[str] = []
        known = schema.attributes
        points = schema.sync_points if timed else ()
        if len(element.attrib) > MAX_ATTRIBUTES:
            attributes(element)  # raises a Fault
        items: Any = element.items()
        for name, text in items:
            spec = known.get(name)
            try:
                if spec is None:
                    if name in points:
                        syncs[name] = self.time(text, element, points)
                    else:
                        foreign[name] = text
                elif spec.read is None:
                    values[spec.field] = self.time(text, element)
                else:
                    values[spec.field] = spec.read(text)
            except ValueError as error:
                if spec is not None and self.lenient and (folded := spec.value.fold(text)) is not None:
                    values[spec.field] = folded
                    continue
                # The message about a reference is complete.
                reason = error if spec is None or spec.read is None else _unwanted(spec, text)
                faults.append(f"{local(name)}: {reason}")
        if schema.old and self.lenient:
            faults += _read_draft_attributes(schema, values, foreign)
        if schema.timed and not timed and "id" not in element.attrib:
            values["id"] = ""  # a part of <face> has no timing, so its id is optional
        for s in schema.required:
            if s.field not in values and s.name not in element.attrib:
                faults.append(f"{s.name}: wanted {s.value.wanted}, got none")
        unknown = self.describe_unknown(schema, element, foreign, timed) if foreign else ""
        if faults and self.forgiving and all(s.field in values for s in schema.required):
            text = f"{'; '.join(faults)}; left out"
            self.remarks.append(Fault(text, element, CUSTOM_ATTRIBUTE_NOT_SUPPORTED))
        elif faults:
            raise Fault("; ".join([*faults, unknown] if unknown else faults), element)
        if unknown:
            self.remarks.append(Fault(unknown, element, CUSTOM_ATTRIBUTE_NOT_SUPPORTED))
        if schema.timed:
            values["syncs"] = syncs
            values["unknown_attributes"] = foreign
        return values

    def describe_unknown(
        self, schema: NodeSchema, element: etree._Element, names: Iterable[str], timed: bool
    ) -> str:
        """Return one message about all unknown attributes, which may be misspelt, or "".

        Attributes of other namespaces have no message.

        Args:
            names: Clark names of attributes that the schema does not have.
            timed: whether sync points are attributes of the element.
        """
        old = schema.old if self.lenient else ()
        names = (name for name in names if name not in old)
        wrong = [name for name in names if name[0] != "{" or name.startswith(_OWN)]
        if not wrong:
            return ""
        known = [name for name in schema.attributes if name[0] != "{"]
        if timed:
            known += schema.sync_points
        around = element.getparent() if schema.timed and not timed else None
        where = "" if around is None else f" inside <{local(str(around.tag))}>"
        texts = [f"{name}: no attribute of <{schema.name}>{where}, so it does nothing" for name in wrong]
        # The list of known attributes occurs once, before the last suggestion.
        texts[-1] += f"; known are {', '.join(known)}" if known else "; there are none"
        kinds = [_of_same_kind(schema, known, element.get(name, "")) for name in wrong]
        return "; ".join(
            text + self.suggest(local(name), kind)
            for text, name, kind in zip(texts, wrong, kinds, strict=True)
        )

    def children(self, schema: NodeSchema, element: etree._Element, values: dict[str, Any]) -> None:
        """Read child elements into the fields of `values`."""
        nodes_by_field: dict[str, list[Any]] = {}
        descriptions: list[Description] = []
        others: list[str] = []
        text = element.text
        for child in element:
            if not text or text.isspace():
                text = child.tail
            tag = self.tag(child)
            spec = schema.by_tag.get(tag)
            if spec is None and tag == _DESCRIPTION and schema.timed:
                descriptions.append(self.description(child))
                continue
            if spec is None and tag.startswith(_KNOWN):
                # Some documents put an extension's children into the core namespace, or into none.
                spec = schema.by_local.get(local(tag))
            if spec is not None:
                nodes_by_field.setdefault(spec[0].field, []).append(self.node(spec[1], child))
                if self.lenient and spec[1] is SpeechText and is_marked_up(child):
                    descriptions.append(described(child))
            elif tag.startswith(_OURS):
                near = self.suggest(local(tag), map(local, schema.by_tag))
                raise Fault(f"wanted {schema.listed}, got <{local(tag)}>{near}", child)
            elif schema.timed:
                others.append(canonical(child))
        if text and not text.isspace():
            self.refuse_text(element)
        for kind in schema.children:
            nodes = nodes_by_field.get(kind.field, [])
            if len(nodes) < kind.least:
                raise Fault(f"wanted {schema.listed}, got none", element)
            if kind.many:
                values[kind.field] = tuple(nodes)
            elif len(nodes) > 1:
                raise Fault(f"wanted one <{local(kind.classes[0].tag)}>, got {len(nodes)}", element)
            elif nodes:
                values[kind.field] = nodes[0]
        if descriptions:
            values["descriptions"] = tuple(descriptions)
        if others:
            values["unknown_children"] = tuple(others)

    def refuse_text(self, element: etree._Element) -> None:
        """Raise a Fault if there is text between the child elements."""
        texts = (element.text, *(child.tail for child in element))
        if text := next((t.strip() for t in texts if t and not t.isspace()), ""):
            hint = ", put it into <text>" if self.tag(element) == Speech.tag else ""
            raise Fault(f"wanted elements, got the text {quoted(text)}{hint}", element)

    def text(self, element: etree._Element) -> str:
        if len(element):
            raise Fault(f"wanted text, got <{local(str(element[0].tag))}>", element[0])
        return element.text or ""

    # description := any XML

    def description(self, element: etree._Element) -> Description:
        if self.lenient and {"priority", "level"}.isdisjoint(element.keys()):
            element.set("priority", "1")
        values = self.attributes(schema_of(Description), element, False)
        if values["type"] == SSML:
            speak = [c for c in element if local(str(c.tag)) == "speak"]
            if len(speak) != 1:
                fault = f"wanted one <speak> for {SSML}, got {len(speak) or 'none'}"
                around = element.getparent()
                is_speech = around is not None and self.tag(around) == Speech.tag
                is_alone = is_speech and around is not None and around.find("{*}text") is None
                if not (self.lenient and is_alone and "".join(map(str, element.itertext())).strip()):
                    raise Fault(fault, element)
                said = f"{fault}: all text of the description is spoken"
                self.remarks.append(Fault(said, element, CUSTOM_ATTRIBUTE_NOT_SUPPORTED))
                return Description(**values, content=described(element).content)
            if (language := element.get(LANGUAGE)) and LANGUAGE not in speak[0].attrib:
                speak[0].set(LANGUAGE, language)  # it is outside of the content
            return Description(**values, content=canonical(speak[0]))
        inside = [escape(element.text or "")]
        for child in element:
            inside += (canonical(child), escape(child.tail or ""))
        return Description(**values, content="".join(inside))

    # constraint := (synchronize | before | after)+

    def constraint(self, element: etree._Element) -> dict[str, Any]:
        """Return the id and parts of a constraint, by field."""
        values = self.attributes(schema_of(Constraint), element, False)
        self.refuse_text(element)
        values["parts"] = tuple(self.constraint_part(child) for child in element)
        if not values["parts"]:
            raise Fault("wanted <synchronize>, <before> or <after>, got none", element)
        return values

    def constraint_part(self, element: etree._Element) -> Synchronize | Before | After:
        tag = self.tag(element)
        cls = _PARTS.get(tag)
        if cls is None and self.lenient and tag == core("synchronise"):
            cls = Synchronize
        if cls is None:
            got = local(str(element.tag))
            raise Fault(f"wanted <synchronize>, <before> or <after>, got <{got}>", element)
        self.refuse_text(element)
        refs = tuple(self.sync(child) for child in element)
        if not refs:
            raise Fault("wanted at least one <sync>, got none", element)
        if cls is Synchronize:
            # In drafts, one of the points is an attribute.
            return Synchronize(refs=((self.ref(element),) if "ref" in element.attrib else ()) + refs)
        return (After if cls is After else Before)(ref=self.ref(element), refs=refs)

    def sync(self, element: etree._Element) -> SyncRef:
        if self.tag(element) != _SYNC:
            raise Fault(f"wanted <sync>, got <{local(str(element.tag))}>", element)
        return self.ref(element)

    def ref(self, element: etree._Element) -> SyncRef:
        text = element.get("ref")
        if text is None:
            raise Fault("ref: wanted a sync reference, got none", element)
        try:
            return self.time(text, element)
        except ValueError as error:
            raise Fault(f"ref: {error}", element) from None

    def time(self, text: str, element: etree._Element, points: Iterable[str] = ()) -> SyncRef:
        """Read a sync reference, also in the forms in which programs write them; `points` are its own."""
        try:
            return read_sync_ref(text, self.names)
        except ValueError:
            id = element.get("id", "").strip() if points else ""
            meant = respelled(text, id, points) if self.lenient else ""
            if not meant:
                raise
            ref = read_sync_ref(meant, self.names)
            self.respelled.append(f"{quoted(text)} as {quoted(meant)}")
            return ref


def _read_draft_attributes(
    schema: NodeSchema, values: dict[str, Any], foreign: dict[str, str]
) -> Iterator[str]:
    """Read attributes by their names in drafts, unless the present name is used too; yield faults."""
    for name, spec in schema.old.items():
        if name in foreign and spec.field not in values and spec.read is not None:
            text = foreign.pop(name)
            try:
                values[spec.field] = spec.read(text)
            except ValueError:
                yield f"{name}: {_unwanted(spec, text)}"


def _unwanted(spec: Attribute, text: str) -> str:
    return describe_mismatch(spec.value.wanted, text, quoted(text))


def _of_same_kind(schema: NodeSchema, known: Iterable[str], value: str) -> list[str]:
    """Return the attributes that can have a value like this: a time or another word."""
    time = ":" in value or NUMBER.fullmatch(value.strip()) is not None
    return [
        name
        for name in known
        if time or (name in schema.attributes and schema.attributes[name].value.low is None)
    ]
