"""Files made of documents on request."""

from __future__ import annotations

import asyncio
import re
import shutil
from http import HTTPStatus

import pytest

from realizer.core.settings import Settings
from realizer.server.http.renderings import MOST_WAITING, Renderings, fault_of
from realizer.server.runtime.session_registry import JoinError

NOD = b'<bml id="a"><head id="n" lexeme="NOD"/></bml>'


def rendered(body: bytes = NOD, **query: str) -> tuple[str, bytes]:
    """The suffix and the content of a file."""
    path = asyncio.run(Renderings(Settings(voice="silent")).render(body, query, "here"))
    try:
        return path.suffix, path.read_bytes()
    finally:
        shutil.rmtree(path.parent)


def refused(body: bytes = NOD, **query: str) -> tuple[int, str]:
    with pytest.raises(JoinError) as error:
        rendered(body, **query)
    return error.value.status, str(error.value)


def test_renderings_are_of_the_format_asked_for() -> None:
    suffix, content = rendered(format="fap", fps="50", seed="3")
    assert suffix == ".fap"
    assert content.splitlines()[0].split()[2] == b"50"


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ({"format": "exe"}, "format: wanted one of fap, json, "),
        ({"mouth": "wide"}, "wanted one of format, face, voice, "),
        ({"face": "../../etc"}, "face: wanted a name of letters, digits, - and _, got '../../etc'"),
        ({"background": "/etc/passwd"}, "background: wanted a colour such as #d8dde2, or transparent, got"),
        ({"face": "nobody"}, "omar, got 'nobody'"),
        ({"fps": "0"}, "fps: 0.0 is not in the range"),
        ({"format": "png", "camera": "nowhere"}, "camera: wanted one of front, "),
    ],
)
def test_renderings_refuse_what_the_query_cannot_say(query, words) -> None:
    status, said = refused(**query)
    assert status == HTTPStatus.BAD_REQUEST
    assert words in said
    assert not re.search("Usage|--|REALIZER|realizer", said)


def test_renderings_refuse_documents_of_which_nothing_plays() -> None:
    status, said = refused(b"<bml")
    assert status == HTTPStatus.UNPROCESSABLE_ENTITY
    assert "line 1: wanted <bml>" in said
    assert "/realizer-" not in said


def test_renderings_refuse_texts_of_which_nothing_can_be_spoken() -> None:
    status, said = refused(b"```\nonly code\n```", format="vtt")
    assert status == HTTPStatus.UNPROCESSABLE_ENTITY
    assert "a block of code is not spoken" in said


def test_renderings_of_one_address_are_limited() -> None:
    async def run() -> list[object]:
        renderings = Renderings(Settings(voice="silent"))
        jobs = [
            asyncio.create_task(renderings.render(NOD, {"format": "fap"}, "here"))
            for _ in range(MOST_WAITING + 1)
        ]
        done, others = await asyncio.wait(jobs, return_when=asyncio.FIRST_COMPLETED)
        for job in others:
            job.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        return [job.exception() for job in done]

    (error,) = asyncio.run(run())
    assert isinstance(error, JoinError)
    assert error.status == HTTPStatus.TOO_MANY_REQUESTS


def test_fault_of_leaves_out_usage_and_our_files(tmp_path) -> None:
    said = f"Usage: realizer\nTry 'x'\n\nError: wanted a\nrealizer: b\n{tmp_path}/face.fap: not written\n"
    assert fault_of(said, tmp_path) == "wanted a\nb"
    said = "realizer: Invalid value for --face: face: wanted a; REALIZER_FACES says b\nrealizer: --at: c\n"
    said += "realizer: Invalid value for --size: wanted d\nrealizer: see realizer realize --help\n"
    assert fault_of(said, tmp_path) == "face: wanted a\nat: c\nsize: wanted d"
    assert fault_of("", tmp_path) == "the renderer ended"
