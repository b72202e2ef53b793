"""Tests of sources of documents."""

from pathlib import Path

import pytest

from bml_schema import Block, BMLError, Speech, parse, read
from realizer.behaviours.registry import VOCABULARY
from realizer.behaviours.speech import UNSAID
from realizer.core.toml_text import parse_toml
from realizer.sources import documents_of, first_error, folder_of, is_file_name, is_markup

NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'


def text_of(bml: str | bytes) -> str:
    (speech,) = (node for node in parse(bml).behaviours if isinstance(node, Speech))
    return str(speech.text)


@pytest.mark.parametrize(
    ("text", "is_file"),
    [
        ("hello.bml", True),
        ("talk.TXT", True),
        ("a/b", True),
        ("my scene.bml", True),
        ("Hello there", False),
        ("e.g. this.", False),
        ("Do it 24/7.", False),
        ("Read the README.txt", False),
        (300 * "and/or ", False),
        ("a/b\0 c", False),
    ],
)
def test_is_file_name_of_a_suffix_or_a_path(text: str, is_file: bool) -> None:
    assert is_file_name(text) is is_file
    assert not is_file_name(f"<bml id='{text}'/>")


def test_is_file_name_of_a_file_with_any_suffix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert not is_file_name("page.html")
    for name in ("page.html", "Hello"):
        (tmp_path / name).write_text("<html/>")
    assert is_file_name("page.html")
    assert not is_file_name("Hello")


@pytest.mark.parametrize("source", ["Tom & Jerry, *you* > 0?", b"Tom & Jerry, *you* > 0?"])
def test_documents_of_a_text_speak_it(source: str | bytes) -> None:
    (document,) = documents_of(source)
    assert text_of(document.bml) == "Tom & Jerry, you more than 0?"
    (document,) = documents_of(source, plain=True)
    assert text_of(document.bml) == "Tom & Jerry, *you* > 0?"


def test_documents_of_a_long_text_speak_all_of_it_in_parts() -> None:
    text = " ".join(f"This is sentence {k}." for k in range(2_000))
    (document,) = documents_of(text)
    blocks = [block for block in read(document.bml) if isinstance(block, Block)]
    assert [block.id for block in blocks] == ["text1", *(f"text1-{k}" for k in range(2, len(blocks) + 1))]
    parts = [str(node.text) for block in blocks for node in block.behaviours if isinstance(node, Speech)]
    assert " ".join(parts) == text
    assert all(part.endswith(".") and len(part) <= 10_000 for part in parts)


@pytest.mark.parametrize("text", ["x" * 25_000, "これはペンです。" * 3_000])
def test_documents_of_a_long_text_without_blanks_speak_all_of_it(text: str) -> None:
    (document,) = documents_of(text)
    blocks = [block for block in read(document.bml) if isinstance(block, Block)]
    parts = [str(node.text) for block in blocks for node in block.behaviours if isinstance(node, Speech)]
    assert "".join(parts) == text
    assert max(map(len, parts)) <= 10_000


def test_documents_of_a_file_are_its_content(tmp_path: Path) -> None:
    for name, content in (("a.bml", NOD), ("b.bml", "no BML")):
        (tmp_path / name).write_text(content)
        for source in (tmp_path / name, str(tmp_path / name)):
            assert documents_of(source) == [(content.encode(), str(tmp_path / name))]


def test_documents_of_a_text_file_speak_it(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("Hello")
    (document,) = documents_of(tmp_path / "a.txt")
    assert text_of(document.bml) == "Hello"


def test_documents_of_a_list_have_ids_of_their_own() -> None:
    first, second, third = (parse(document.bml) for document in documents_of(["One", NOD, "Two"]))
    assert (first.id, second.id, third.id) == ("text1", "b", "text3")
    assert third.composition == "APPEND"


@pytest.mark.parametrize("source", ["hello.bml", "no/such/file", Path("hello.bml")])
def test_documents_of_a_missing_file_are_an_error(source: str | Path) -> None:
    with pytest.raises(FileNotFoundError) as error:
        documents_of(["Hello", source])
    assert error.value.filename == str(source) or error.value.filename == source


@pytest.mark.parametrize("source", [None, 3, {"a": 1}, ["Hello", 3], bytearray(b"Hello")])
def test_documents_of_another_type_are_an_error(source: object) -> None:
    with pytest.raises(TypeError, match=r"source: wanted BML, a text, .*, got (None|int|dict|byte)"):
        documents_of(source)  # type: ignore[arg-type]


def test_documents_of_an_empty_list_are_an_error() -> None:
    with pytest.raises(ValueError, match="got no document"):
        documents_of([])


def test_documents_of_a_text_name_characters_that_xml_cannot_hold() -> None:
    block = parse(documents_of("A\x01 page\fthen\vthis.")[0].bml, VOCABULARY)
    (speech,) = block.behaviours
    assert isinstance(speech, Speech)
    assert str(speech.text) == "A page then this."
    assert "U+0001" in speech.unknown_attributes[UNSAID]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_documents_of_a_text_file_are_read_in_its_encoding(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "a.txt").write_bytes("Grüße: “ja”, 5 €.".encode(encoding))
    (document,) = documents_of(tmp_path / "a.txt", language="de")
    assert text_of(document.bml) == "Grüße: “ja”, fünf Euro."


def test_is_markup_of_documents_only() -> None:
    table = parse_toml((Path(__file__).parent / "text" / "markup.toml").read_text("utf-8"))
    assert [text for text in table["documents"] if not is_markup(text)] == []
    assert [text for text in table["texts"] if is_markup(text)] == []


def test_marks_of_a_text_are_behaviours_of_its_document() -> None:
    block = parse(documents_of("Well [nod] *smiles* yes :)\n\n```\ncode\n```")[0].bml, VOCABULARY)
    assert [type(node).__name__ for node in block.behaviours] == [
        "Speech",
        "Head",
        "FaceLexeme",
        "FaceLexeme",
    ]
    assert [str(node.syncs["start"]) for node in block.behaviours[1:]] == [
        "speech:at-1-1 + 0", "speech:at-1-2 + 0", "speech:at-1-3 + 0"
    ]  # fmt: skip
    assert "a block of code is not spoken" in block.behaviours[0].unknown_attributes[UNSAID]


def test_first_error_has_the_line_the_path_and_the_file(tmp_path: Path) -> None:
    (tmp_path / "a.bml").write_text("<!-- -->\n<bml/>")
    error = first_error(documents_of([tmp_path / "a.bml"]), VOCABULARY, strict_bml=False)
    assert isinstance(error, BMLError)
    assert (error.line, error.path) == (2, "/bml")
    assert str(tmp_path / "a.bml") in str(error)


def test_folder_of_is_the_only_folder_of_all_files(tmp_path: Path) -> None:
    names = [str(tmp_path / name) for name in ("a.bml", "b.bml", "c/d.bml")]
    for name in names:
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(NOD)
    assert folder_of([*names[:2], "-", "", "Hello there.", NOD, str(tmp_path / "no.bml")]) == tmp_path
    assert folder_of(names) is None
    assert folder_of(["Hello there."]) is None


def test_documents_of_a_sound_file_play_it(tmp_path: Path) -> None:
    path = tmp_path / "a talk & more.wav"
    path.write_bytes(b"RIFF")
    (document,) = documents_of(path)
    (block,) = read(document.bml)
    assert isinstance(block, Block)
    (speech,) = block.behaviours
    assert 'fileName="a talk &amp; more.wav"' in speech.descriptions[0].content


def test_documents_of_a_sound_file_with_another_suffix(tmp_path: Path) -> None:
    for name in ("talk.m4a", "talk.txt", "talk.dat", "talk"):
        (tmp_path / name).write_bytes(b"\0\0\0\x1cftypM4A and more")
        (document,) = documents_of(tmp_path / name)
        (speech,) = parse(document.bml).behaviours
        assert f'fileName="{name}"' in speech.descriptions[0].content
