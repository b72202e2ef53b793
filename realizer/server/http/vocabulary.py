"""The vocabulary as JSON: elements, lexemes, emotions, AUs, FAPs, profiles, voices."""

import functools
import json
from collections.abc import Sequence
from typing import Any

from bml_schema import CORE, EXTENSIONS, Block, Constraint, Required
from bml_schema.node_schema import local, schema_of
from realizer.behaviours.registry import VOCABULARY

PREFIXES = {
    CORE: "",
    EXTENSIONS: "",
    "http://www.asap-project.org/bmla": "bmla",
    "http://hmi.ewi.utwente.nl/bmlt": "bmlt",
    "urn:bml-realizer:1": "realizer",
}
# Elements without a schema: the parser reads constraints itself.
RELATIONS = ("synchronize", "before", "after")


@functools.cache
def vocabulary() -> bytes:
    """Return the vocabulary, which is computed once.

    elements: name, namespace, usual prefix, attributes (wanted values, words), children, sync points.
    values: {"element attribute": words} for words that are looked up in a table.
    aus, faps, groups: for the sliders. wheel: points, in degrees and 0..7. profiles: {set: names}.
    """
    from realizer.animation.axis import AU_NAMES
    from realizer.emotions.archetypes import archetypes
    from realizer.emotions.words import known_words
    from realizer.expressions.library import builtin
    from realizer.speech.registry import voices
    from realizer.tables import action_units, faps, regions
    from realizer.tables.emotions import ring
    from realizer.tables.lexemes import face_lexemes, head_lexemes

    known, words = AU_NAMES(), sorted(known_words())
    aus = [
        {"au": row.au, "name": row.name, "sides": f"{row.au}L" in known}
        for row in action_units()
        if f"{row.au}L" in known or str(row.au) in known
    ]
    movable = [_fields(row, "fap", "name", "group", "unit", "least", "most") for row in faps()[2:]]
    values = {
        "faceLexeme lexeme": list(face_lexemes()),
        "head lexeme": list(head_lexemes()),
        "faceFacs au": [str(au["au"]) for au in aus],
        "emotion name": words,
        "mood name": words,
        "emotion profile": ["own", "published", "raw"],
        "mood profile": ["own", "published", "raw"],
        "expression name": list(builtin()),
        "fap number": [str(fap["fap"]) for fap in movable],
    }
    groups = {"aus": regions("au"), "faps": regions("fap")}
    profiles = {
        kind: [f"{name} {number}" for name, numbered in archetypes(kind).items() for number in numbered]
        for kind in ("published", "raw")
    }
    data = {
        "elements": _elements(),
        "values": values,
        "aus": aus,
        "faps": movable,
        "groups": {kind: [_fields(row, "name", "members") for row in rows] for kind, rows in groups.items()},
        "wheel": [_fields(row, "name", "kind", "angle", "activation") for row in ring("paul").values()],
        "profiles": profiles,
        "voices": [_fields(voice, "name", "engine", "available") for voice in voices()],
    }
    return json.dumps(data, separators=(",", ":")).encode()


def _fields(row: object, *names: str) -> dict[str, Any]:
    return {name: getattr(row, name) for name in names}


def _elements() -> list[dict[str, Any]]:
    parts = [*(local(tag) for tag in VOCABULARY), "constraint"]
    children: dict[str, list[str]] = {
        local(Block.tag): [*parts, "required"],
        local(Required.tag): parts,
        local(Constraint.tag): list(RELATIONS),
        "text": ["sync"],
        **{name: ["sync"] for name in RELATIONS},
    }
    classes: list[type[Any]] = [Block, Required, Constraint, *VOCABULARY.values()]
    elements = {local(cls.tag): _element(cls, children) for cls in classes}
    for cls in classes:
        for kind in schema_of(cls).children:
            for inner in kind.classes:
                elements.setdefault(local(inner.tag), _element(inner, children))
    core = {"namespace": CORE, "prefix": "", "syncs": [], "about": ""}
    for name in RELATIONS:
        ref = [] if name == "synchronize" else [_attribute("ref", "a sync reference", required=True)]
        elements[name] = {"name": name, **core, "attributes": ref, "children": children[name]}
    sync = [_attribute("ref", "a sync reference"), _attribute("id", "a name")]
    elements["sync"] = {"name": "sync", **core, "attributes": sync, "children": []}
    return list(elements.values())


def _element(cls: type[Any], children: dict[str, list[str]]) -> dict[str, Any]:
    shape, name = schema_of(cls), local(cls.tag)
    namespace = cls.tag[1:].partition("}")[0]
    attributes = []
    for spec in shape.attributes.values():
        space, _, plain = spec.name.rpartition("}")
        prefix = PREFIXES.get(space[1:], "")
        written = f"{prefix}:{plain}" if prefix else plain
        attribute = _attribute(written, spec.value.wanted, spec.value.words, required=spec.required)
        attributes.append(attribute | {"namespace": space[1:]})
    return {
        "name": name,
        "namespace": namespace,
        "prefix": PREFIXES.get(namespace, ""),
        "attributes": attributes,
        "children": children.get(name) or [local(c.tag) for kind in shape.children for c in kind.classes],
        "syncs": list(shape.sync_points),
        "about": (cls.__doc__ or "").strip().partition("\n")[0],
    }


def _attribute(
    name: str, wanted: str, words: Sequence[str] = (), *, required: bool = False
) -> dict[str, Any]:
    return {"name": name, "wanted": wanted, "words": list(words), "required": required, "namespace": ""}
