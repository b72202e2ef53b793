"""Tests of the schema of glTF documents."""

from __future__ import annotations

from typing import Any

import pytest

from realizer_studio.faces.arkit.gltf_schema import document_fault

ASSET: dict[str, Any] = {"asset": {"version": "2.0"}}
ACCESSOR = {"componentType": 5126, "count": 3, "type": "VEC3"}


def test_document_fault_finds_none_in_a_sound_document() -> None:
    nodes = [{"name": 3, "mesh": 0, "scale": [1, 1, 1.5]}]
    assert document_fault(ASSET | {"nodes": nodes, "accessors": [ACCESSOR], "unknown": {"x": []}}) == ""


@pytest.mark.parametrize(
    ("part", "fault"),
    [
        ({"asset": None}, "asset: wanted a valid dictionary, got None"),
        ({"scene": -1}, "scene: wanted greater than or equal to 0, got -1"),
        ({"nodes": 5}, "nodes: wanted a valid list, got 5"),
        ({"nodes": [{"mesh": "0"}]}, "nodes[0].mesh: wanted a valid integer, got '0'"),
        ({"nodes": [{"mesh": True}]}, "nodes[0].mesh: wanted a valid integer, got True"),
        ({"nodes": [{"rotation": [0, 0]}]}, "nodes[0].rotation: wanted at least 4 items"),
        ({"accessors": [ACCESSOR | {"count": 2**31}]}, "accessors[0].count: wanted less than 2147483648"),
        ({"accessors": [ACCESSOR | {"count": 10**5000}]}, "accessors[0].count: wanted less than"),
        ({"accessors": [{"count": 1, "type": "VEC3"}]}, "accessors[0].componentType: wanted a value"),
    ],
)
def test_document_fault_names_the_place(part: dict[str, Any], fault: str) -> None:
    assert document_fault(ASSET | part).startswith(fault)


@pytest.mark.parametrize("document", [None, [], "x", 5])
def test_document_fault_refuses_what_is_no_object(document: Any) -> None:
    assert document_fault(document).startswith("document: wanted a valid dictionary")
