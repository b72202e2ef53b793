"""What a client is told that says hello."""

from __future__ import annotations


def test_hello_is_answered_with_what_there_is(driver) -> None:
    (welcome,) = driver.send({"type": "hello"}).of("welcome")
    assert welcome["session"] == "test"
    assert "mesh" in welcome["capabilities"]["streams"]
    assert welcome["limits"]["document"] == 2**20


def test_a_client_is_told_every_limit_it_can_meet(drive) -> None:
    limits = {"max_elements": 7, "max_duration": 8, "max_speech": 9, "max_rate": 10, "max_pixels": 1000}
    (welcome,) = drive(**limits).send({"type": "hello"}).of("welcome")
    told = {f"max_{name}": value for name, value in welcome["limits"].items()}
    assert limits.items() <= told.items()
