"""The error that all methods of the clients raise."""

from typing import Any, Self

from realizer.core.errors import RealizerError


class ClientError(RealizerError):
    """The service refused a message, or the connection has ended.

    Attributes:
        code: as in the message `error`; "refused" for a block, "connection" for the end.
    """

    def __init__(self, text: str, code: str = "connection") -> None:
        super().__init__(text)
        self.code = code

    @classmethod
    def of(cls, error: dict[str, Any]) -> Self:
        """Return the exception for a message `error`."""
        return cls(f"{error.get('where', '')}: {error['message']}".removeprefix(": "), error["code"])


class ClosedError(ClientError):
    """The program has closed the connection itself, which ends its iterations."""

    def __init__(self, text: str = "the connection has ended: it was closed here") -> None:
        super().__init__(text)


class LostError(ClientError):
    """The connection was lost, or was not opened, for a reason that may pass."""
