"""A worker without speech, for the tests of processes; its requests say what it does."""

import os
import signal
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
            "echo": self.echo, "hang": self.hang, "fail": self.fail, "die": self.die, "wait": self.wait
        }  # fmt: skip

    def hello(self) -> dict[str, Any]:
        return {"rate": 8000, "chatty": self.chatty}

    def echo(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        self.count += 1
        if self.chatty:
            print("this is no answer", flush=True)
        text = request["text"].encode()
        return {"count": self.count}, [text[:2], text[2:]]

    def hang(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        signal.pause()
        return {}, []

    def fail(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        raise ValueError("it cannot")

    def wait(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        """Keep a pipe open, whose reader sees when the process ends; its number is the first line."""
        with Path(request["pipe"]).open("w") as pipe:
            print(os.getpid(), file=pipe, flush=True)
            signal.pause()
        return {}, []

    def die(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        os._exit(3)


def load(arguments: list[str]) -> Fake:
    return Fake(arguments)
