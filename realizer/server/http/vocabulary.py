"""The vocabulary as JSON: elements, lexemes, emotions, AUs, FAPs, profiles, voices."""

from __future__ import annotations

import functools
import json
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
# What `schema_of` does not tell: a constraint is read by the parser itself.
RELATIONS = ("synchronize", "before", "after")


@functools.cache
def vocabulary() -> bytes:
    """All of it; made once.

    elements: name, namespace, usual prefix, attributes (what is wanted, words), children, sync points.
    values: {"element attribute": words} where a word is looked up in a table.
    aus, faps, groups: what the sliders are made of. wheel: places, degrees and 0..7. profiles: {set: names}.
    """
    return json.dumps(
        {
            "elements": _elements(),
            "values": _values(),
            "aus": _aus(),
            "faps": _faps(),
            "groups": _groups(),
            "wheel": _wheel(),
            "profiles": _profiles(),
            "voices": _voices(),
        },
        ensure_ascii=False,
        separators=(",", ":"),
    ).encode()


def _elements() -> list[dict[str, Any]]:
    behaviours = [local(tag) for tag in VOCABULARY]
    inside = [*behaviours, "constraint"]
    children: dict[str, list[str]] = {
        local(Block.tag): [*inside, "required"],
        local(Required.tag): inside,
        local(Constraint.tag): list(RELATIONS),
        "text": ["sync"],
        **{name: ["sync"] for name in RELATIONS},
    }
    classes: list[type[Any]] = [Block, Required, Constraint, *VOCABULARY.values()]
    found = {local(cls.tag): _element(cls, children) for cls in classes}
    for cls in classes:
        for kind in schema_of(cls).children:
            for inner in kind.classes:
                found.setdefault(local(inner.tag), _element(inner, children))
    plain = {"namespace": CORE, "prefix": "", "syncs": []}
    for name in RELATIONS:
        ref = [] if name == "synchronize" else [_attribute("ref", "a sync reference", required=True)]
        found[name] = {"name": name, **plain, "attributes": ref, "children": children[name], "about": ""}
    sync = [_attribute("ref", "a sync reference"), _attribute("id", "a name")]
    found["sync"] = {"name": "sync", **plain, "attributes": sync, "children": [], "about": ""}
    return list(found.values())


def _element(cls: type[Any], children: dict[str, list[str]]) -> dict[str, Any]:
    shape, name = schema_of(cls), local(cls.tag)
    namespace = cls.tag[1:].partition("}")[0]
    attributes = []
    for spec in shape.attributes.values():
        space, _, plain = spec.name.rpartition("}")
        prefix = PREFIXES.get(space[1:], "")
        attributes.append(
            _attribute(
                f"{prefix}:{plain}" if prefix else plain,
                spec.value.wanted,
                spec.value.words,
                required=spec.required,
                namespace=space[1:],
            )
        )
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
    name: str, wanted: str, words: tuple[str, ...] = (), *, required: bool = False, namespace: str = ""
) -> dict[str, Any]:
    return {
        "name": name,
        "wanted": wanted,
        "words": list(words),
        "required": required,
        "namespace": namespace,
    }


def _values() -> dict[str, list[str]]:
    from realizer.emotions.words import known_words
    from realizer.expressions.library import builtin
    from realizer.tables.lexemes import face_lexemes, head_lexemes

    words = sorted(known_words())
    return {
        "faceLexeme lexeme": list(face_lexemes()),
        "head lexeme": list(head_lexemes()),
        "faceFacs au": [str(au["au"]) for au in _aus()],
        "emotion name": words,
        "mood name": words,
        "emotion profile": ["own", "published", "raw"],
        "mood profile": ["own", "published", "raw"],
        "expression name": list(builtin()),
        "fap number": [str(fap["fap"]) for fap in _faps()],
    }


def _aus() -> list[dict[str, Any]]:
    from realizer.animation.axis import AU_NAMES
    from realizer.tables import action_units

    known = AU_NAMES()
    return [
        {"au": row.au, "name": row.name, "sides": f"{row.au}L" in known}
        for row in action_units()
        if f"{row.au}L" in known or str(row.au) in known
    ]


def _faps() -> list[dict[str, Any]]:
    from realizer.tables import faps

    return [
        {
            "fap": row.fap,
            "name": row.name,
            "group": row.group,
            "unit": row.unit,
            "least": row.least,
            "most": row.most,
        }
        for row in faps()[2:]
    ]


def _groups() -> dict[str, list[dict[str, Any]]]:
    from realizer.tables.control_groups import au_regions, fap_regions

    found = {"aus": au_regions(), "faps": fap_regions()}
    return {kind: [{"name": r.name, "members": r.members} for r in rows] for kind, rows in found.items()}


def _wheel() -> list[dict[str, Any]]:
    from realizer.tables.wheel_words import ring

    return [
        {"name": p.name, "kind": p.kind, "angle": p.angle, "activation": p.activation}
        for p in ring("paul").values()
    ]


def _profiles() -> dict[str, list[str]]:
    from realizer.emotions.archetypes import archetypes

    return {
        kind: [f"{name} {number}" for name, numbered in archetypes(kind).items() for number in numbered]
        for kind in ("published", "raw")
    }


def _voices() -> list[dict[str, Any]]:
    from realizer.speech.registry import voices

    return [{"name": v.name, "engine": v.engine, "available": v.available} for v in voices()]
