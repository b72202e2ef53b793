"""A worker without speech, for the tests of processes; its requests say what it does."""

import os
import time
from pathlib import Path
from typing import Any


class Fake:
    """Counts its requests in `count`, which forks do not share.

    Args:
        arguments: "drifts", "broken" or "chatty".
    """

    def __init__(self, arguments: list[str]) -> None:
        if "broken" in arguments:
            raise RuntimeError("it has no data")
        self.chatty = "chatty" in arguments
        self.drifts = "drifts" in arguments
        self.count = 0
        self.operations = {
            "echo": self.echo, "sleep": self.sleep, "fail": self.fail, "die": self.die, "wait": self.wait
        }  # fmt: skip

    def hello(self) -> dict[str, Any]:
        return {"rate": 8000, "chatty": self.chatty}

    def echo(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        self.count += 1
        if self.chatty:
            print("this is no answer", flush=True)
        text = request["text"].encode()
        return {"count": self.count}, [text[:2], text[2:]]

    def sleep(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        time.sleep(60)
        return {}, []

    def fail(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        raise ValueError("it cannot")

    def wait(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        """Write to a pipe after a while, during which its reader sees that the process lives."""
        with Path(request["pipe"]).open("w") as pipe:
            time.sleep(10)
            pipe.write("it lives")
        return {}, []

    def die(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        os._exit(3)


def load(arguments: list[str]) -> Fake:
    return Fake(arguments)
