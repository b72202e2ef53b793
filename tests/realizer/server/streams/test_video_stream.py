"""Pictures: drawn once for all their subscribers, late ones skipped."""

from __future__ import annotations

import pytest

from realizer.core.errors import RenderError


def subscribe(stream: str, **fields):
    return {"type": "subscribe", "stream": stream, **fields}


def test_video_stream_draws_the_newest_frame_and_skips_late_ones(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video", "size": [64, 64], "fps": 10})
    driver.run(1.0)
    (first,) = driver.draws
    assert first.options.size == (64, 64)
    assert first.pose.shape == (68,)
    driver.session.on_picture(first.id, b"jpeg", driver.opened + 1.0)
    driver.collect()
    assert [(f.frame, f.payload) for f in client.frames] == [(0, b"jpeg")]
    assert len(driver.draws) == 2
    driver.session.on_picture(driver.draws[1].id, b"next", driver.opened + 1.05)
    driver.collect()
    assert client.frames[-1].frame == 10
    driver.send({"type": "state"})
    assert client.of("state")[0]["dropped"] == 9


def test_video_stream_draws_a_picture_once_for_all_subscribers(driver) -> None:
    driver.join(2)
    for connection in (1, 2):
        driver.send({"type": "subscribe", "stream": "video", "fps": 10}, connection)
    driver.run(0.05)
    assert len(driver.draws) == 1
    driver.session.on_picture(driver.draws[0].id, b"jpeg", driver.opened + 0.05)
    driver.collect()
    assert [len(driver.clients[c].frames) for c in (1, 2)] == [1, 1]


def test_video_stream_ends_with_one_error_if_drawing_fails(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video"})
    driver.run(0.1)
    driver.session.on_picture(driver.draws[0].id, RenderError("install EGL"), driver.opened + 0.1)
    driver.collect()
    driver.run(2.0)
    assert [e["message"] for e in client.of("error")] == ["install EGL"]
    assert len(driver.draws) == 1


def test_video_stream_draws_different_options_separately(driver) -> None:
    driver.join(2)
    driver.send({"type": "subscribe", "stream": "video"}, 1)
    look = {"camera": "profile", "light": "evening", "background": "#102030"}
    driver.send({"type": "subscribe", "stream": "video", **look}, 2)
    driver.run(0.05)
    plain, own = (draw.options for draw in driver.draws)
    assert (plain.camera, plain.light, plain.background) == ("front", None, None)
    assert (own.camera, own.light, own.background) == ("profile", "evening", "#102030")


@pytest.mark.parametrize("form", ["jpeg", "png", "webp"])
def test_video_stream_draws_in_the_requested_format(driver, form) -> None:
    client = driver.send(subscribe("video", size=[64, 64], format=form, quality=70))
    assert client.of("subscribed")[0]["media_type"] == f"image/{form}"
    driver.run(0.05)
    assert [(draw.options.form, draw.options.quality) for draw in driver.draws] == [(form, 70)]
