"""Subscriptions: encodings, options, replies, and the filter of feedback."""

from __future__ import annotations

import pytest

from realizer.face.load import load_face
from realizer.protocol.streams import STREAMS
from realizer.protocol.wire import unpack
from realizer.server.streams.frame_windows import SOURCES
from tests.realizer.server.conftest import NOD

NUMBERS = " or ".join(row.name for row in STREAMS.values() if row.numeric)
FAP = {"type": "subscribe", "stream": "fap"}


def subscribe(stream: str, **fields):
    return {"type": "subscribe", "stream": stream, **fields}


@pytest.mark.parametrize("stream", sorted(STREAMS))
def test_subscribe_accepts_exactly_the_encodings_of_a_stream(driver, stream: str) -> None:
    for encoding in STREAMS[stream].encodings:
        reply = driver.send({"type": "subscribe", "stream": stream, "encoding": encoding}).of("subscribed")[
            -1
        ]
        assert (reply["stream"], reply["encoding"]) == (stream, encoding)
    other = next(word for word in ("binary", "json", "text") if word not in STREAMS[stream].encodings)
    (error,) = driver.send({"type": "subscribe", "stream": stream, "encoding": other}).of("error")
    assert error["where"] == "subscribe.encoding"
    assert f"for {stream}, got {other}" in error["message"]


@pytest.mark.parametrize("stream", sorted(SOURCES))
def test_subscribe_names_every_value(driver, stream: str) -> None:
    driver.send({"type": "subscribe", "stream": stream})
    client = driver.run(0.1)
    (reply,) = client.of("subscribed")
    assert {len(frame.values) for frame in client.frames} == {len(set(reply["names"]))}


def test_announce_face_change_precedes_the_first_new_mesh(drive) -> None:
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
        (reply,) = client.of("changed")
        assert (reply["stream"], reply.get("character"), reply["face"]) == ("mesh", name, "ben")
        assert reply["vertices"] == len(load_face("ben").vertices)
        kinds = [m if isinstance(m, str) else unpack(m) for m in client.messages]
        at = next(k for k, m in enumerate(kinds) if isinstance(m, str) and '"changed"' in m)
        before, after = kinds[at - 1], kinds[at + 1]
        assert (before.frame + 1, len(before.values)) == (reply["frame"], len(load_face("ada").vertices))
        assert (after.frame, len(after.values)) == (reply["frame"], reply["vertices"])
        assert reply["frame"] == fps + 1


def test_subscribe_bounds_the_pixels_of_all_views_together(drive) -> None:
    driver = drive(max_pixels=64 * 64 * 50)
    driver.join(2)
    driver.join(3)

    def look(connection: int, **options) -> str:
        """The answer to a subscription of pictures, 64 x 64 at 25 a second."""
        message = {"type": "subscribe", "stream": "video", "size": [64, 64], "fps": 25, **options}
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


def test_subscribe_runs_views_of_a_character_side_by_side(drive) -> None:
    driver = drive()

    def look(**options) -> int:
        message = {"type": "subscribe", "stream": "video", "size": [64, 64], "fps": 10, **options}
        reply = driver.send(message).of("subscribed")[-1]
        assert reply.get("view") == options.get("view")
        return int(reply["index"])

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


def test_subscribe_replaces_the_stream_of_the_first_character(driver) -> None:
    driver.send({"type": "character", "id": "Ada"})
    driver.send({"type": "subscribe", "stream": "fap", "fps": 10})
    driver.send({"type": "subscribe", "stream": "fap", "fps": 20, "character": "Ada"})
    client = driver.run(1.0)
    assert [frame.time for frame in client.frames[-3:]] == pytest.approx([0.9, 0.95, 1.0])
    driver.send({"type": "unsubscribe", "stream": "fap"})
    count = len(client.frames)
    driver.run(2.0)
    assert len(client.frames) == count


def test_unsubscribe_ends_a_stream(driver) -> None:
    driver.send(FAP)
    driver.run(0.2)
    count = len(driver.send({"type": "unsubscribe", "stream": "fap"}).frames)
    assert len(driver.run(1.0).frames) == count


def test_unsubscribe_ends_feedback(driver) -> None:
    viewer = driver.join(2)
    driver.send({"type": "unsubscribe", "stream": "feedback"}, 2)
    driver.send(NOD.format("b"))
    driver.run(10)
    assert not viewer.feedback
    assert driver.clients[1].feedback


def test_subscribe_returns_the_index_of_the_character(driver) -> None:
    driver.send('<bml id="a" characterId="Ada"><wait id="w"/></bml>')
    driver.send('<bml id="b" characterId="Bob"><faceLexeme id="f" lexeme="SMILE" end="3"/></bml>')
    client = driver.send({"type": "subscribe", "stream": "au", "character": "Bob"})
    assert client.of("subscribed")[0]["index"] == 1
    assert {f.character for f in driver.run(1.0).frames} == {1}


def test_subscribe_refuses_a_picture_that_is_too_large(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video", "size": [100000, 100000]})
    assert client.of("error")[0]["where"] == "subscribe.size"


def test_subscribe_names_the_known_lights(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video", "light": "noon"})
    (error,) = client.of("error")
    assert error["where"] == "subscribe.light"
    assert "portrait, daylight, evening, studio, outdoors" in error["message"]


def test_subscribe_to_feedback_again_begins_with_new_messages(driver) -> None:
    driver.send({"type": "unsubscribe", "stream": "feedback"})
    driver.send(NOD.format("a"))
    client = driver.run(10)
    assert not client.feedback
    newest = driver.session.feedback_log.newest
    driver.send({"type": "subscribe", "stream": "feedback"})
    assert not client.feedback
    driver.send(NOD.format("b"))
    driver.run(20)
    assert [f.seq for f in client.feedback] == list(range(newest + 1, driver.session.feedback_log.newest + 1))


def test_subscribe_to_feedback_filters_by_element(driver) -> None:
    viewer = driver.join(2)
    message = {"type": "subscribe", "stream": "feedback", "elements": ["blockProgress"]}
    assert driver.send(message, 2).of("subscribed")[0]["elements"] == ["blockProgress"]
    driver.send(NOD.format("b"))
    driver.run(5)
    assert viewer.ids == ["b:start", "b:end"]
    assert len(driver.clients[1].ids) > 2
    numbers = [f.seq for f in viewer.feedback]
    assert numbers == sorted(numbers)
    assert numbers != list(range(1, len(numbers) + 1)), "what was left out keeps its number"


def test_subscribe_to_feedback_filters_by_character(driver) -> None:
    viewer = driver.join(2)
    driver.send({"type": "subscribe", "stream": "feedback", "character": "Ann"}, 2)
    driver.send('<bml id="a" characterId="Ann"/>')
    driver.send('<bml id="b" characterId="Bob"/>')
    driver.send("<bml/>")
    driver.run(1)
    assert {f.character_id for f in viewer.feedback} == {"Ann", None}
    assert not any("b:" in id for id in viewer.ids)


def test_subscribe_to_feedback_without_elements_removes_the_filter(driver) -> None:
    driver.send({"type": "subscribe", "stream": "feedback", "elements": ["warningFeedback"]})
    driver.send({"type": "subscribe", "stream": "feedback"})
    driver.send(NOD.format("b"))
    driver.run(5)
    assert "b:end" in driver.clients[1].ids


def test_subscribe_to_feedback_refuses_an_unknown_element(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "feedback", "elements": ["blockprogress"]})
    assert client.of("error")[0]["code"] == "invalid"


@pytest.mark.parametrize(
    ("stream", "option", "words"),
    [
        ("fap", {"size": [64, 64]}, "wanted the stream video, got fap"),
        ("mesh", {"ahead": 0.2}, f"wanted the stream {NUMBERS}, got mesh"),
    ],
)
def test_subscribe_refuses_an_option_of_another_stream(driver, stream: str, option, words: str) -> None:
    (error,) = driver.send({"type": "subscribe", "stream": stream, "fps": 25, **option}).of("error")
    assert error["where"] == f"subscribe.{next(iter(option))}"
    assert error["message"] == words


def test_subscribe_refuses_a_transparent_jpeg(driver) -> None:
    client = driver.send(subscribe("video", background="transparent"))
    assert client.of("error")[0]["where"] == "subscribe.background"
    driver.send(subscribe("video", background="transparent", format="png"))
    driver.run(0.05)
    assert [draw.options.background for draw in driver.draws] == ["transparent"]


def test_subscribe_names_the_known_cameras(driver) -> None:
    (error,) = driver.send(subscribe("video", camera="moon")).of("error")
    assert error["where"] == "subscribe.camera"
    assert "front, three-quarter" in error["message"]
