"""The attachments of tasks: clips, documents and their errors."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bml_schema import Block, read
from realizer.animation.fap.fap_clip import FAPClip
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.server.transports.xface.attachments import MissingAttachment, Script, prepare
from realizer.server.transports.xface.wire import Task

MASK = " ".join("1" if fap == 3 else "0" for fap in range(1, 69))
FAP = f"2.1 x 25 1\n{MASK}\n0 5\n"
BML = '<bml id="a"><wait id="w" duration="1"/></bml>'


def test_prepare_returns_a_clip_for_an_upload() -> None:
    clip = prepare(Task("UPLOAD_FAP", params=(FAP,)), Settings())
    assert isinstance(clip, FAPClip)
    assert clip.values[0, 2] == 5


def test_prepare_reads_files_of_the_media_folder(tmp_path: Path) -> None:
    (tmp_path / "x.fap").write_text(FAP)
    assert isinstance(prepare(Task("LOAD_FAP", params=("x.fap",)), Settings(media=tmp_path)), FAPClip)


@pytest.mark.parametrize(
    ("text", "blocks"),
    [
        (BML, ("a",)),
        (BML + BML.replace('"a"', '"b"'), ("a", "b")),
        (BML.replace("<", "&lt;").replace(">", "&gt;"), ("a",)),
        ("<bml" + BML, ("a",)),
    ],
)
@pytest.mark.parametrize("processor", ["BML", " bml\n"])
def test_prepare_returns_the_documents_and_block_ids_of_a_script(
    text: str, blocks: tuple[str, ...], processor: str
) -> None:
    script = prepare(Task("UPLOAD_SCRIPT", params=(text, processor)), Settings())
    assert isinstance(script, Script)
    assert script.blocks == blocks


def test_prepare_gives_every_document_of_a_dialect_its_own_id() -> None:
    act = '<act><bml><head type="NOD"/></bml><bml id=""><head type="NOD"/></bml><bml id="c"/></act>'
    found: list[str] = []
    for _ in range(2):
        script = prepare(Task("UPLOAD_SCRIPT", params=(act, "BML")), Settings())
        assert isinstance(script, Script)
        assert script.blocks[-1] == "c"
        assert [block.id for block in read(script.text) if isinstance(block, Block)] == list(script.blocks)
        found += script.blocks[:-1]
    assert len(set(found)) == 4


@pytest.mark.parametrize("name", ["STOP_PLAYBACK", "RESUME_PLAYBACK", "DANCE"])
def test_prepare_returns_none_for_other_tasks(name: str) -> None:
    assert prepare(Task(name, params=("x",)), Settings()) is None


@pytest.mark.parametrize(
    ("task", "says"),
    [
        (Task("UPLOAD_FAP", params=("hello world",)), "line 1: wanted a header"),
        (Task("UPLOAD_FAP", params=("2.1 x 25 0\n",)), "wanted frames, got none"),
        (Task("LOAD_FAP", params=("x.fap",)), "media"),
        (Task("UPLOAD_SCRIPT", params=(BML, "SMIL-Agent")), "wanted the processor BML, got 'SMIL-Agent'"),
        (Task("UPLOAD_SCRIPT", params=("<bml/>", "BML")), "wanted BML, got"),
        (Task("UPLOAD_SCRIPT", params=("x", "BML")), "wanted BML, got"),
    ],
)
def test_prepare_says_what_cannot_be_parsed(task: Task, says: str) -> None:
    with pytest.raises(RealizerError, match=re.escape(says)) as raised:
        prepare(task, Settings())
    assert not isinstance(raised.value, MissingAttachment)


def test_prepare_refuses_a_file_that_is_too_long_to_play() -> None:
    text = "\n".join(["2.1 x 25 500", *(f"{MASK}\n{k} {k}" for k in range(500))])
    with pytest.raises(
        RealizerError,
        match=r"at most 1000 bytes of BML, got 500 frames of 1 FAPs: send parts .REALIZER_MAX_DOCUMENT",
    ):
        prepare(Task("UPLOAD_FAP", params=(text,)), Settings(max_document=2024))
    assert prepare(Task("UPLOAD_FAP", params=(text,)), Settings())


def test_prepare_refuses_a_script_that_is_too_large_before_parsing() -> None:
    task = Task("UPLOAD_SCRIPT", params=(BML + BML, "BML"))
    with pytest.raises(RealizerError, match=r"at most 50 bytes of BML .* .REALIZER_MAX_DOCUMENT"):
        prepare(task, Settings(max_document=50))
    with pytest.raises(RealizerError, match=r"at most 3 elements .*, got 4 .REALIZER_MAX_ELEMENTS"):
        prepare(task, Settings(max_elements=3))


def test_prepare_accepts_a_script_as_large_as_the_settings_permit() -> None:
    large = BML.replace("><wait", f"><!--{'x' * 2**20}--><wait")
    assert prepare(Task("UPLOAD_SCRIPT", params=(large, "BML")), Settings(max_document=2**21))


@pytest.mark.parametrize("name", ["UPLOAD_FAP", "LOAD_FAP", "UPLOAD_SCRIPT"])
@pytest.mark.parametrize("params", [(), ("",), (" \n",)])
def test_prepare_tells_a_missing_attachment_apart(name: str, params: tuple[str, ...]) -> None:
    with pytest.raises(MissingAttachment, match="wanted params, got none, or empty ones"):
        prepare(Task(name, params=params), Settings())
