"""FaceEditor's parameter XML (Paul 2010, appendix C): reader and writer.

The printed DTD lacks its beginning. We assume that an `fp-position` has fp, x, y, z; that a deformer's x, y,
z is its neutral feature point; that a mask lists the vertices that move; that smooth-center and
smooth-side are percent, as ease is; and that a plain `deformer`, without a size, moves a part as a whole.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.errors import FaceError
from realizer.tables import faps
from realizer_studio.faces.mpeg4.zones import Setup, Triple, Zone

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

ROOT = "faceeditor-parameters"
CHILDREN = ("fp-positions", "keep-syncs", "deformers", "vertex-masks")
AXES = ("x", "y", "z")
ZONE = (*AXES, "fap", "size", "scalex", "scaley", "scalez", "use-vertex-mask", "invert-vertex-mask")
ATTRIBUTES = {
    "ease-deformer": (*ZONE, "ease"),
    "smooth-deformer": (*ZONE, "smooth-center", "smooth-side"),
    "deformer": (*AXES, "fap"),
}
# A raised cosine is this Bezier curve within half a percent: percent, and the share of the size.
AS_SMOOTH, AS_SIZE = 57.28, 0.63581
LARGEST = 16 * 2**20  # bytes


def read_faceeditor(path: Path) -> Setup:
    """Read the parameters of a FaceEditor file, in the file's coordinates; `fitted` converts them.

    Raises:
        FaceError: no such file, not XML, or an element or attribute that is missing, unknown or no number.
    """
    from xml.etree import ElementTree

    try:
        text = path.read_bytes()
    except OSError as error:
        raise FaceError(f"{path}: wanted a file of FaceEditor, got {error.strerror}") from None
    if len(text) > LARGEST or b"<!ENTITY" in text:
        raise FaceError(f"{path}: wanted at most {LARGEST} bytes and no entities of its own")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:  # ValueError: of encodings
        raise FaceError(f"{path}: wanted well-formed XML, got: {error}") from None
    tags = tuple(child.tag for child in root)
    if root.tag != ROOT or tags != CHILDREN:
        raise FaceError(
            f"{path}: wanted <{ROOT}> with {', '.join(CHILDREN)} once each and in order; got <{root.tag}> "
            f"with {', '.join(tags) or 'nothing'}"
        )
    positions, syncs, deformers, masks = root
    points: dict[str, Triple] = {}
    for element in positions:
        attributes = _attributes(path, element, "fp-position", ("fp", *AXES))
        points[attributes["fp"]] = _position(path, element)
    zones: dict[int, Zone] = {}
    rigid = set()
    for element in deformers:
        if element.tag not in ATTRIBUTES:
            raise FaceError(f"{path}: deformers: wanted {', '.join(ATTRIBUTES)}; got <{element.tag}>")
        _attributes(path, element, element.tag, ATTRIBUTES[element.tag])
        fap = _fap(path, element, element.get("fap"))
        if fap in zones or fap in rigid:
            raise FaceError(f"{path}: FAP {fap} has two deformers; delete one")
        points.setdefault(faps()[fap - 1].feature_point, _position(path, element))
        if element.tag == "deformer":
            rigid.add(fap)
        else:
            zones[fap] = _zone(path, element, fap)
    vertices = {}
    for element in masks:
        _attributes(path, element, "vertex-mask", ("fap",))
        words = (element.text or "").split()
        if not all(word.isdecimal() and len(word) < 10 for word in words):
            raise FaceError(f"{path}: vertex-mask of FAP {element.get('fap')}: wanted indices of vertices")
        mask = np.unique(np.array(words, np.int64)).astype(np.int32)
        vertices[_fap(path, element, element.get("fap"))] = mask
    synced = frozenset(_fap(path, syncs, word) for word in (syncs.text or "").split())
    return Setup(points, zones, vertices, synced, rigid=frozenset(rigid))


def write_faceeditor(path: Path, setup: Setup) -> tuple[str, ...]:
    """Write a FaceEditor file.

    Returns:
        A sentence for each property that the format cannot express.
    """
    from xml.sax.saxutils import quoteattr

    def line(depth: int, tag: str, values: Mapping[str, Any], closed: bool = True) -> str:
        inside = "".join(f" {key}={quoteattr(str(value).lower())}" for key, value in values.items())
        return f"{'  ' * depth}<{tag}{inside}{'/>' if closed else '>'}"

    losses = []
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', _doctype(), f"<{ROOT}>", "  <fp-positions>"]
    lines += [
        line(2, "fp-position", {"fp": name, **dict(zip(AXES, position, strict=True))})
        for name, position in setup.points.items()
    ]
    lines += ["  </fp-positions>", f"  <keep-syncs>{' '.join(map(str, sorted(setup.synced)))}</keep-syncs>"]
    lines.append("  <deformers>")
    for fap in sorted({*setup.zones, *setup.rigid}):
        position = setup.points.get(faps()[fap - 1].feature_point, (0.0, 0.0, 0.0))
        start = {**dict(zip(AXES, position, strict=True)), "fap": fap}
        if fap in setup.rigid:
            lines.append(line(2, "deformer", start))
            continue
        zone = setup.zones[fap]
        if zone.slide or zone.radial:
            losses.append(f"FAP {fap}: slide and radial: all vertices move straight in FaceEditor")
        tag, size, falloff = _element_of(zone)
        x, y, z = zone.scale
        shape = {"size": size, "scalex": x, "scaley": y, "scalez": z}
        use = {"use-vertex-mask": zone.use_mask, "invert-vertex-mask": zone.invert_mask}
        lines.append(line(2, tag, start | shape | use | falloff))
    lines += ["  </deformers>", "  <vertex-masks>"]
    lines += [
        f"{line(2, 'vertex-mask', {'fap': fap}, False)}{' '.join(map(str, mask.tolist()))}</vertex-mask>"
        for fap, mask in sorted(setup.masks.items())
    ]
    lines += ["  </vertex-masks>", f"</{ROOT}>"]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return tuple(losses)


def fitted(setup: Setup, points: Mapping[str, Triple]) -> Setup:
    """Return the setup translated and scaled to a face's coordinates, by the feature points of both.

    FaceEditor's axes are those of this project, but x may be mirrored, and the unit depends on the model.
    Masks are kept: they are valid for meshes with the same numbering of vertices only.

    Raises:
        FaceError: fewer than three points in common, or all in one place.
    """
    common = sorted(set(setup.points) & set(points))
    if len(common) < 3:
        raise FaceError(
            f"wanted at least three feature points that both have, got {', '.join(common) or 'none'}"
        )
    source = np.array([setup.points[name] for name in common], float)
    target = np.array([points[name] for name in common], float)
    best: tuple[float, float, Any, Any] | None = None
    for flip in (np.ones(3), np.array([-1.0, 1.0, 1.0])):
        a, b = source * flip - (source * flip).mean(axis=0), target - target.mean(axis=0)
        scatter = float((a * a).sum())
        if scatter < 1e-18:
            raise FaceError("the feature points in common lie in one place: nothing can be fitted to them")
        scale = float((a * b).sum()) / scatter
        error = float(((a * scale - b) ** 2).sum())
        if scale > 0 and (best is None or error < best[0]):
            best = error, scale, flip, target.mean(axis=0) - scale * (source * flip).mean(axis=0)
    if best is None:
        raise FaceError("the feature points in common are exchanged: nothing can be fitted to them")
    _, scale, flip, shift = best

    def moved(position: Triple) -> Triple:
        x, y, z = (scale * flip * np.array(position) + shift).tolist()
        return x, y, z

    zones = {
        fap: replace(zone, size=zone.size * scale, pivot=moved(zone.pivot) if zone.radial else zone.pivot)
        for fap, zone in setup.zones.items()
    }
    return replace(
        setup, zones=zones, points={name: moved(position) for name, position in setup.points.items()}
    )


def _element_of(zone: Zone) -> tuple[str, float, dict[str, float]]:
    """Return element, size and the attributes of the falloff."""
    if zone.falloff in ("ease", "linear"):
        return "ease-deformer", zone.size, {"ease": zone.ease if zone.falloff == "ease" else 0.0}
    if zone.falloff == "cosine":
        return "smooth-deformer", zone.size * AS_SIZE, {"smooth-center": AS_SMOOTH, "smooth-side": AS_SMOOTH}
    smooth = {"smooth-center": 100 * zone.smooth_centre, "smooth-side": 100 * zone.smooth_side}
    return "smooth-deformer", zone.size, smooth


def _zone(path: Path, element: Element, fap: int) -> Zone:
    size, x, y, z = (_number(path, element, name) for name in ("size", "scalex", "scaley", "scalez"))
    values: dict[str, Any] = {
        key: _flag(path, element, name)
        for key, name in (("use_mask", "use-vertex-mask"), ("invert_mask", "invert-vertex-mask"))
    }
    if element.tag == "ease-deformer":
        values |= {"falloff": "ease", "ease": _number(path, element, "ease")}
    else:
        values |= {
            "falloff": "smooth",
            "smooth_centre": _number(path, element, "smooth-center") / 100,
            "smooth_side": _number(path, element, "smooth-side") / 100,
        }
    try:
        return Zone(fap, size=size, scale=(x, y, z), **values)
    except FaceError as error:
        raise FaceError(f"{path}: {error}") from None


def _attributes(path: Path, element: Element, tag: str, names: tuple[str, ...]) -> dict[str, str]:
    if element.tag != tag or set(element.attrib) != set(names):
        raise FaceError(
            f"{path}: wanted <{tag}> with {', '.join(names)}; got <{element.tag}> with "
            f"{', '.join(element.attrib) or 'nothing'}"
        )
    return dict(element.attrib)


def _position(path: Path, element: Element) -> Triple:
    x, y, z = (_number(path, element, name) for name in AXES)
    return x, y, z


def _number(path: Path, element: Element, name: str) -> float:
    text = element.get(name, "")
    if not re.fullmatch(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*", text):
        raise FaceError(f"{path}: <{element.tag}> {name}: wanted a number, got {text!r}")
    return float(text)


def _flag(path: Path, element: Element, name: str) -> bool:
    text = element.get(name, "").strip().lower()
    if text not in ("true", "false", "1", "0"):
        raise FaceError(f"{path}: <{element.tag}> {name}: wanted true or false, got {text!r}")
    return text in ("true", "1")


def _fap(path: Path, element: Element, text: str | None) -> int:
    if text is None or not text.strip().isdecimal() or not 3 <= int(text) <= 68:
        raise FaceError(f"{path}: <{element.tag}>: wanted a FAP from 3 to 68, got {text!r}")
    return int(text)


def _doctype() -> str:
    elements = [
        f"<!ELEMENT {ROOT} ({', '.join(CHILDREN)})>",
        "<!ELEMENT fp-positions (fp-position+)>",
        "<!ELEMENT keep-syncs (#PCDATA)>",
        f"<!ELEMENT deformers ({' | '.join(ATTRIBUTES)})*>",
        "<!ELEMENT vertex-masks (vertex-mask*)>",
        "<!ELEMENT vertex-mask (#PCDATA)>",
        *(f"<!ELEMENT {tag} EMPTY>" for tag in ("fp-position", *ATTRIBUTES)),
    ]
    attributes = {"fp-position": ("fp", *AXES), **ATTRIBUTES, "vertex-mask": ("fap",)}
    lists = [
        f"<!ATTLIST {tag} {name} CDATA #REQUIRED>" for tag, names in attributes.items() for name in names
    ]
    return "\n".join([f"<!DOCTYPE {ROOT} [", *elements, *lists, "]>"])
