"""The answers to the Face tab."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer.core.settings import Settings
from realizer.face.load import load_folder
from realizer_studio.editors.face import studio as studio_module
from realizer_studio.editors.face.studio import Studio
from realizer_studio.faces.check import check_face
from tests.bare_heads import bare_head


class Asking:
    """A studio that is asked as the page asks it."""

    def __init__(self, edit: Path | None) -> None:
        self.studio = Studio(Settings(edit=edit), True)

    def __call__(self, kind: str, payload: bytes = b"", **fields: Any) -> dict[str, Any]:
        text = json.dumps({"type": kind, "id": 7, **fields})
        message = len(text).to_bytes(4, "little") + text.encode() + payload if payload else text
        answer = self.studio.answer(message)
        if isinstance(answer, str):
            return json.loads(answer)  # type: ignore[no-any-return]
        header: dict[str, Any] = json.loads(answer[4 : 4 + int.from_bytes(answer[:4], "little")])
        for name, (kind, count, start) in header["arrays"].items():
            header[name] = np.frombuffer(answer, f"<{kind}", count, start)
        return header


@pytest.fixture(scope="module")
def ada(tmp_path_factory):  # type: ignore[no-untyped-def]
    """A studio with a face, and the description of its head."""
    asking = Asking(tmp_path_factory.mktemp("edit"))
    yield asking, asking("open", face="ada")
    asking.studio.close()


def moved(head: dict[str, Any], *faps: int, **change: Any) -> dict[str, Any]:
    """The setup of a head with zones for these FAPs alone, changed."""
    zones = [{**zone, **change} for zone in head["setup"]["zone"] if zone["fap"] in faps]
    return {**head["setup"], "zone": zones, "synced": [], "masks": {}}


def test_studio_opens_a_face(ada) -> None:  # type: ignore[no-untyped-def]
    head = ada[1]
    assert head["type"] == "head"
    assert head["name"] == "ada"
    assert head["editable"]
    assert len(head["vertices"]) == 3 * head["parts"]["shirt"][1]


def test_studio_moves_a_part_of_the_head(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head = ada
    posed = asking("pose", values={3: 500})["vertices"]
    assert np.abs(posed - head["vertices"]).max() > 0.005


def test_studio_gives_the_shape_of_the_face(ada) -> None:  # type: ignore[no-untyped-def]
    field = ada[0]("field", fap=4)["field"].reshape(-1, 3)
    assert np.abs(field).max() > 1e-6


def test_studio_scores_one_fap(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head = ada
    fine = asking("score", faps=[65], setup=moved(head, 65, 66), keep=True)["scores"]
    tiny = asking("score", faps=[65], setup=moved(head, 65, 66, size=0.004), keep=True)["scores"]
    assert [row["score"] for row in fine] == [3, 3]
    assert tiny[0]["score"] < 3
    assert "neighbours move apart" in tiny[0]["why"][-1]


def test_studio_saves_a_sound_face_and_tells_of_a_conflict(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head = ada
    setup = moved(head, 31, 32)
    first = asking("save", name="mine", expected=head["version"], setup=setup, keep=True)
    assert first["saved"] == "faces/mine"
    folder = asking.studio._edit
    assert check_face("mine", folder) == ()
    again = asking("save", name="mine", expected="of another page", setup=setup, keep=True)
    assert "saved by somebody else" in again["error"]
    assert again["conflict"] == first["version"]
    assert "saved" in asking("save", name="mine", expected=again["conflict"], setup=setup, keep=True)
    other = asking("open", face="mine")
    assert other["by"] == [31, 32]
    assert other["keep"]
    asking("open", face="ada")


def test_studio_reads_back_the_xml_that_it_writes(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head = ada
    setup = {**moved(head, 19, 33, falloff="ease", ease=40.0), "masks": {"19": "5-9 12"}}
    text = asking("xml", setup=setup)["text"]
    once = asking("read", text.encode(), name="zones.xml")["setup"]
    again = asking("read", asking("xml", setup=once)["text"].encode(), name="zones.xml")["setup"]
    assert once == again
    assert once["masks"] == {"19": "5-9 12"}
    assert once["points"] == {name: list(place) for name, place in head["points"].items()}


@pytest.mark.slow
def test_studio_makes_a_glb_of_an_imported_head(tmp_path: Path) -> None:
    asking = Asking(None)
    try:
        head = asking("import", bare_head(tmp_path / "My Head.glb").read_bytes(), name="My Head.glb")
        assert head["name"] == "my-head"
        assert head["by"] == [zone["fap"] for zone in head["setup"]["zone"]]
        assert not head["keep"]
        assert asking("glb", setup=head["setup"])["glb"][:4].tobytes() == b"glTF"
    finally:
        asking.studio.close()


WRONG = (
    ("nothing", {}, "type: wanted one of open, import"),
    ("open", {"face": "../ada"}, "face: wanted one of ada"),
    ("pose", {"values": {"2": 1}}, "values: wanted numbers by FAP"),
    ("field", {"fap": 99}, "fap: wanted 3 to 68"),
    ("score", {}, "setup: wanted a table of zones"),
    ("score", {"setup": {"zone": [{"fap": 4}]}}, "setup: zone 1: falloff is missing"),
    ("xml", {"setup": {"sizes": []}}, "setup: wanted joined"),
    ("save", {"name": "../x", "setup": {}}, "name: wanted a-z"),
    ("read", {"name": "zones.xml"}, "zones.xml: wanted well-formed XML"),
)


@pytest.mark.parametrize(("kind", "fields", "words"), WRONG, ids=[f"{row[0]} {row[2][:12]}" for row in WRONG])
def test_studio_says_what_is_wrong(ada, kind: str, fields: dict[str, Any], words: str) -> None:  # type: ignore[no-untyped-def]
    assert ada[0](kind, **fields)["error"].startswith(words)


def test_studio_refuses_what_is_no_message(ada) -> None:  # type: ignore[no-untyped-def]
    for message in ("{", b"\1", "[]"):
        assert "wanted" in json.loads(ada[0].studio.answer(message))["error"]


def test_studio_saves_nothing_without_a_folder() -> None:
    asking = Asking(None)
    assert "start the service with --edit DIR" in asking("save", name="x", setup={})["error"]
    assert "there is no head yet" in asking("pose", values={})["error"]
    asking.studio.close()


@pytest.mark.parametrize(
    ("number", "words"),
    [(errno.ENOSPC, "the disk is full"), (errno.EROFS, "the service may not write there")],
)
def test_studio_keeps_the_saved_face_when_a_disk_fails(ada, monkeypatch, number: int, words: str) -> None:  # type: ignore[no-untyped-def]
    asking, head = ada
    setup, name = moved(head, 33, 34), f"kept-{number}"
    version = asking("save", name=name, setup=setup, keep=True)["version"]

    def fail(*args: object) -> None:
        raise OSError(number, "no", name)

    monkeypatch.setattr(studio_module, "copy_with_zones", fail)
    failed = asking("save", name=name, expected=version, setup=moved(head, 33, 34, size=0.02), keep=True)
    assert words in failed["error"]
    assert load_folder(asking.studio._edit / name, None).name == name
    assert studio_module._version(asking.studio._edit / name) == version
