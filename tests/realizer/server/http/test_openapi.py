"""The description of the HTTP interface."""

from __future__ import annotations

from realizer.outputs.registry import OUTPUTS
from realizer.server.http.openapi import description
from realizer.server.http.renderings import OPTIONS


def test_description_names_every_format_and_option() -> None:
    realize = description()["paths"]["/realize"]["post"]
    names = {parameter["name"]: parameter["schema"] for parameter in realize["parameters"]}
    assert set(names) == {"format", *OPTIONS}
    assert [f".{name}" for name in names["format"]["enum"]] == list(OUTPUTS)


def test_description_has_the_prefix_of_the_application() -> None:
    assert description("/face")["servers"] == [{"url": "/face"}]
    assert description()["servers"] == [{"url": "/"}]


def test_description_tells_what_each_operation_answers() -> None:
    for path in description()["paths"].values():
        for operation in path.values():
            assert operation["summary"]
            assert "default" in operation["responses"]


def test_description_has_the_status_of_what_is_done_or_accepted() -> None:
    paths = description()["paths"]
    for path in ("/realize", "/check"):
        assert set(paths[path]["post"]["responses"]) >= {"200"}
    assert set(paths["/sessions/{session}/bml"]["post"]["responses"]) >= {"202"}
