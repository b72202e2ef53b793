"""The message `welcome`."""

from __future__ import annotations


def test_welcome_has_capabilities_and_limits(driver) -> None:
    (welcome,) = driver.send({"type": "hello"}).of("welcome")
    assert welcome["session"] == "test"
    assert "mesh" in welcome["capabilities"]["streams"]
    assert welcome["limits"]["document"] == 2**20


def test_welcome_has_the_limits_of_the_settings(drive) -> None:
    limits = {"max_elements": 7, "max_duration": 8, "max_speech": 9, "max_rate": 10, "max_pixels": 1000}
    (welcome,) = drive(**limits).send({"type": "hello"}).of("welcome")
    announced = {f"max_{name}": value for name, value in welcome["limits"].items()}
    assert limits.items() <= announced.items()
