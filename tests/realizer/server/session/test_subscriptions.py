"""Streams are given, replaced and ended one by one; who gets them is told what their values mean."""

from __future__ import annotations

import pytest

from realizer.face.load import load_face
from realizer.protocol.streams import STREAMS
from realizer.protocol.wire import unpack
from realizer.server.streams.frame_windows import SOURCES


@pytest.mark.parametrize("stream", sorted(STREAMS))
def test_each_stream_is_given_in_each_of_its_encodings_and_in_no_other(driver, stream: str) -> None:
    for encoding in STREAMS[stream].encodings:
        told = driver.send({"type": "subscribe", "stream": stream, "encoding": encoding}).of("subscribed")[-1]
        assert (told["stream"], told["encoding"]) == (stream, encoding)
    other = next(word for word in ("binary", "json", "text") if word not in STREAMS[stream].encodings)
    (error,) = driver.send({"type": "subscribe", "stream": stream, "encoding": other}).of("error")
    assert error["where"] == "subscribe.encoding"
    assert f"for {stream}, got {other}" in error["message"]


@pytest.mark.parametrize("stream", sorted(SOURCES))
def test_what_numbers_are_is_told_one_by_one(driver, stream: str) -> None:
    driver.send({"type": "subscribe", "stream": stream})
    client = driver.run(0.1)
    (told,) = client.of("subscribed")
    assert {len(frame.values) for frame in client.frames} == {len(set(told["names"]))}


def test_who_gets_meshes_is_told_of_another_face_before_the_first_one_of_it(drive) -> None:
    driver = drive(idle=False)
    for number in (2, 3, 4):
        driver.join(number)
    driver.send({"type": "subscribe", "stream": "mesh", "fps": 25}, 1)
    driver.send({"type": "subscribe", "stream": "mesh", "fps": 10, "character": "Ada"}, 2)
    driver.send({"type": "subscribe", "stream": "mesh", "fps": 10, "character": "Ben"}, 3)
    driver.send({"type": "subscribe", "stream": "fap"}, 4)
    driver.run(1.0)
    driver.send({"type": "character", "id": "Ada", "face": "ben"}, 3)
    driver.run(2.0)
    first, ada, ben, fap = (driver.clients[number] for number in (1, 2, 3, 4))
    assert ben.of("changed") == fap.of("changed") == []
    for client, name, fps in ((first, None, 25), (ada, "Ada", 10)):
        (told,) = client.of("changed")
        assert (told["stream"], told.get("character"), told["face"]) == ("mesh", name, "ben")
        assert told["vertices"] == len(load_face("ben").vertices)
        kinds = [m if isinstance(m, str) else unpack(m) for m in client.messages]
        at = next(k for k, m in enumerate(kinds) if isinstance(m, str) and '"changed"' in m)
        before, after = kinds[at - 1], kinds[at + 1]
        assert (before.frame + 1, len(before.values)) == (told["frame"], len(load_face("ada").vertices))
        assert (after.frame, len(after.values)) == (told["frame"], told["vertices"])
        assert told["frame"] == fps + 1


def test_the_pictures_of_a_session_are_bounded_together_and_a_shared_one_counts_once(drive) -> None:
    driver = drive(max_pixels=64 * 64 * 50)
    driver.join(2)
    driver.join(3)

    def look(connection: int, **asked) -> str:
        """The answer to a subscription of pictures, 64 x 64 at 25 a second."""
        message = {"type": "subscribe", "stream": "video", "size": [64, 64], "fps": 25, **asked}
        return driver.send(message, connection).json[-1]["type"]

    assert look(1) == look(2) == "subscribed"  # the same picture
    assert look(2, light="evening") == "subscribed"  # its own, in place of that
    assert look(3, character="Ada", light="evening") == "subscribed"  # the first and only one there is
    assert look(2, camera="three-quarter") == "error"  # a third one
    (error,) = driver.clients[2].of("error")
    assert error["where"] == "subscribe.fps"
    assert "REALIZER_MAX_PIXELS" in error["message"]
    driver.send({"type": "unsubscribe", "stream": "video"})
    driver.send({"type": "unsubscribe", "stream": "video", "character": "Ada"}, 3)
    assert look(2, camera="three-quarter") == "subscribed"


def test_videos_of_one_character_with_views_of_their_own_run_side_by_side(drive) -> None:
    driver = drive()

    def look(**asked) -> int:
        message = {"type": "subscribe", "stream": "video", "size": [64, 64], "fps": 10, **asked}
        told = driver.send(message).of("subscribed")[-1]
        assert told.get("view") == asked.get("view")
        return int(told["index"])

    plain, side, far = look(), look(view="side", camera="three-quarter"), look(view="far", fps=5)
    assert plain == 0
    assert len({plain, side, far}) == 3
    for draw in driver.draws:
        driver.session.on_picture(draw.id, f"{draw.options.camera}".encode(), driver.opened)
    driver.collect()
    assert {frame.character: frame.payload for frame in driver.clients[1].frames} == {
        plain: b"front",
        side: b"three-quarter",
        far: b"front",
    }
    assert look(view="side") == side, "the same again, in its place"
    assert len(driver.session.subscriptions.views()) == 2, "who looks alike looks at the same pictures"
    driver.send({"type": "unsubscribe", "stream": "video", "view": "far"})
    driver.send({"type": "unsubscribe", "stream": "video"})
    assert look(view="new") not in (plain, side)
    assert len(driver.session.subscriptions.views()) == 1
    for number in range(238):
        look(view=f"v{number}")
    error = driver.send({"type": "subscribe", "stream": "video", "view": "one more"}).of("error")[-1]
    assert (error["where"], error["message"]) == ("subscribe.view", "wanted at most 240 views")


def test_a_stream_of_the_first_character_is_replaced_whether_it_is_named_or_not(driver) -> None:
    driver.send({"type": "character", "id": "Ada"})
    driver.send({"type": "subscribe", "stream": "fap", "fps": 10})
    driver.send({"type": "subscribe", "stream": "fap", "fps": 20, "character": "Ada"})
    client = driver.run(1.0)
    assert [frame.time for frame in client.frames[-3:]] == pytest.approx([0.9, 0.95, 1.0])
    driver.send({"type": "unsubscribe", "stream": "fap"})
    count = len(client.frames)
    driver.run(2.0)
    assert len(client.frames) == count
