"""Tests of files of the media folder."""

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.behaviours import media as files
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.media import MediaError, faults, load, media_file


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("hello.wav", "hello.wav"),
        (" hello.wav ", "hello.wav"),
        ("./hello.wav", "hello.wav"),
        ("sounds/bell.wav", "sounds/bell.wav"),
        ("sounds\\bell.wav", "sounds/bell.wav"),
        ("C:\\projects\\demo\\sounds\\bell.wav", "sounds/bell.wav"),
        ("file:///C:/projects/demo/sounds/bell.wav", "sounds/bell.wav"),
        ("file:hello.wav", "hello.wav"),
        ("file:///home/somebody/hello%2Ewav", "hello.wav"),
    ],
)
def test_media_file_is_found_in_the_folder(media: Path, name: str, found: str) -> None:
    assert media_file(name, PlanningContext(media=media)) == (media / found).resolve()


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("/etc/passwd", "relative to the media folder"),
        ("../secret.wav", 'without ".."'),
        ("sounds/../../secret.wav", 'without ".."'),
        ("..\\secret.wav", 'without ".."'),
        ("file:///a/../../secret.wav", 'without ".."'),
        ("file:///a/%2e%2e/secret.wav", 'without ".."'),
        ("http://example.org/x.wav", "got an address"),
        ("out.wav", "a link that leads out"),
        ("away/secret.wav", "a link that leads out"),
        ("sounds", "wanted a file of the media folder"),
        (".", "wanted the name of a file"),
        ("helo.wav", 'did you mean "hello.wav"?'),
        ("sounds/BELL.WAV", 'did you mean "sounds/bell.wav"?'),
        ("nothing.like.it", "wanted a file of the media folder"),
        ("a\0b.wav", "wanted a file of the media folder"),
        ("x" * 5000, "wanted a file of the media folder"),
        ("circle/x.wav", "wanted a file of the media folder"),
    ],
)
def test_media_file_refuses_names_that_lead_elsewhere(media: Path, name: str, says: str) -> None:
    secret = media.parent / "secret.wav"
    secret.write_bytes(b"secret")
    (media / "out.wav").symlink_to(secret)
    (media / "away").symlink_to(media.parent)
    (media / "circle").symlink_to(media / "circle")
    with pytest.raises(MediaError) as error:
        media_file(name, PlanningContext(media=media))
    assert says in str(error.value)
    assert len(str(error.value)) < 400


@given(st.text(st.sampled_from("ab./\\:%2eE~") | st.characters(exclude_categories=["Cs"]), max_size=30))
def test_media_file_never_leads_out_of_the_folder(
    tmp_path_factory: pytest.TempPathFactory, name: str
) -> None:
    folder = tmp_path_factory.getbasetemp() / "media"
    folder.mkdir(exist_ok=True)
    (folder / "a").write_bytes(b"inside")
    (folder.parent / "b").write_bytes(b"outside")
    try:
        path = media_file(name, PlanningContext(media=folder))
    except MediaError:
        return
    assert path.is_relative_to(folder.resolve())


def test_media_file_follows_a_link_inside_the_folder(media: Path) -> None:
    (media / "same.wav").symlink_to("sounds/bell.wav")
    assert media_file("same.wav", PlanningContext(media=media)) == (media / "sounds/bell.wav").resolve()


def test_media_file_without_a_folder_is_a_fault_with_a_hint(play) -> None:
    played = play('<bmlt:audiofile id="a" fileName="hello.wav"/><own:fapFile id="f" fileName="smile.fap"/>')
    assert played.warnings == [("b:a", "CANNOT_CREATE_BEHAVIOR"), ("b:f", "CANNOT_CREATE_BEHAVIOR")]
    assert all("--media DIR" in warning.text for warning in played.realization.warnings)


def test_load_refuses_a_file_that_is_too_large(media: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with (media / "large.wav").open("wb") as file:
        file.truncate(files.MAX_BYTES + 1)  # sparse

    def read(content: bytes) -> bytes:
        raise AssertionError("it was read")

    (fault,) = faults("large.wav", PlanningContext(media=media), read)
    assert fault.fatal
    assert "wanted at most 64 MiB" in fault.text


def test_load_reads_a_file_again_only_after_a_change(media: Path) -> None:
    world, reads = PlanningContext(media=media), []

    def read(content: bytes) -> int:
        reads.append(len(content))
        return len(content)

    (media / "x").write_bytes(b"1")
    assert faults("x", world, read) == ()
    assert [load("x", world, read) for _ in range(3)] == [1, 1, 1]
    assert reads == [1]
    (media / "x").write_bytes(b"12")
    os.utime(media / "x", ns=(1, 1))
    assert faults("x", world, read) == ()
    assert load("x", world, read) == 2
    # A playing behaviour is not affected when the file is deleted; a new one is.
    (media / "x").unlink()
    assert load("x", world, read) == 2
    assert faults("x", world, read)
