"""Files made of documents on request, by `realizer realize` in processes of their own."""

import asyncio
import contextlib
import re
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from http import HTTPStatus
from pathlib import Path

from realizer.core.settings import Settings
from realizer.outputs.registry import OUTPUTS
from realizer.server.runtime.session_registry import JoinError

AT_ONCE = 2
MOST_WAITING = 8  # of one address
PATIENCE = 600.0  # s
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")
NUMBER = re.compile(r"[0-9.]{1,12}")
# Options of the command that a query may have -> their form. None of them names a file.
OPTIONS = {
    "face": NAME, "voice": NAME, "camera": NAME, "light": NAME,
    "background": re.compile("#[0-9a-fA-F]{6}|transparent"), "size": re.compile("[0-9]{1,4}x[0-9]{1,4}"),
    "fps": NUMBER, "at": NUMBER, "seed": re.compile("-?[0-9]{1,18}"),
    "language": re.compile("[A-Za-z0-9-]{2,35}"), "morphs": NAME, "plain": re.compile("true|false"),
}  # fmt: skip
# What their values look like, in words.
WORDS = {
    **dict.fromkeys(OPTIONS, "a name of letters, digits, - and _"),
    **dict.fromkeys(("fps", "at"), "a number"),
    "background": "a colour such as #d8dde2, or transparent", "size": "WIDTHxHEIGHT, such as 640x480",
    "seed": "an integer", "language": "a BCP-47 tag, such as nl-NL", "plain": "true or false",
}  # fmt: skip
# Hints for users of the command.
HINTS = r", or the path of a face folder or a GLB|; (REALIZER_|`realizer ).*"
# Exit status of the command -> status of the answer.
STATUS = {1: HTTPStatus.UNPROCESSABLE_ENTITY, 2: HTTPStatus.BAD_REQUEST, 3: HTTPStatus.SERVICE_UNAVAILABLE}


class Renderings:
    """Documents that become files: a few at a time, and one at a time of each address.

    Args:
        settings: of the service; a request that names no face or voice gets its.
    """

    def __init__(self, settings: Settings) -> None:
        self._defaults = {"face": settings.face, "voice": settings.voice, "light": settings.light}
        self._slots = asyncio.Semaphore(AT_ONCE)
        self._locks: dict[str, asyncio.Lock] = {}
        self._waiting: Counter[str] = Counter()

    async def render(self, document: str | bytes, query: Mapping[str, str], address: str) -> Path:
        """Return the file made of a document; its folder is the caller's to remove.

        Args:
            query: `format`, a name of `realizer outputs`, and the names of OPTIONS.

        Raises:
            JoinError: with the status of the answer.
        """
        suffix, options = self._options(query)
        if self._waiting[address] >= MOST_WAITING:
            words = f"{MOST_WAITING} documents from {address} wait to be rendered: wanted fewer"
            raise JoinError(HTTPStatus.TOO_MANY_REQUESTS, words)
        self._waiting[address] += 1
        folder = Path(tempfile.mkdtemp(prefix="realizer-"))
        try:
            async with self._locks.setdefault(address, asyncio.Lock()), self._slots:
                sent = document.encode() if isinstance(document, str) else document
                return await _run(sent, [*options, "-o", str(folder / f"face{suffix}")], folder)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        finally:
            self._waiting[address] -= 1
            if not self._waiting[address]:
                del self._waiting[address], self._locks[address]

    def _options(self, query: Mapping[str, str]) -> tuple[str, list[str]]:
        suffix = f".{query.get('format', 'json')}"
        if suffix not in OUTPUTS:
            known = ", ".join(name.removeprefix(".") for name in OUTPUTS)
            raise JoinError(HTTPStatus.BAD_REQUEST, f"format: wanted one of {known}, got {suffix[1:81]!r}")
        options = []
        asked = {name: value for name, value in query.items() if name not in ("format", "token")}
        for name, value in asked.items():
            if name not in OPTIONS:
                words = f"wanted one of format, {', '.join(OPTIONS)}, got {name[:80]!r}"
                raise JoinError(HTTPStatus.BAD_REQUEST, words)
            if not OPTIONS[name].fullmatch(value):
                words = f"{name}: wanted {WORDS[name]}, got {value[:80]!r}"
                raise JoinError(HTTPStatus.BAD_REQUEST, words)
        asked.pop("plain", None)  # of the text, which is a document by now
        drawn = OUTPUTS[suffix].picture_size is not None
        wanted: dict[str, str | None] = {**self._defaults, **asked}
        for name, choice in wanted.items():
            if choice is not None and (name != "light" or drawn or name in asked):
                options += [f"--{name}", choice]
        return suffix, options


async def _run(body: bytes, options: list[str], folder: Path) -> Path:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "realizer", "--quiet", "realize", "-", *options,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
        cwd=folder,
    )  # fmt: skip
    try:
        async with asyncio.timeout(PATIENCE):
            _, said = await process.communicate(body)
    except TimeoutError:
        words = f"wanted a document that is rendered in {PATIENCE:g} s, got a longer one"
        raise JoinError(HTTPStatus.GATEWAY_TIMEOUT, words) from None
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
    if process.returncode:
        status = STATUS.get(process.returncode, HTTPStatus.INTERNAL_SERVER_ERROR)
        raise JoinError(status, fault_of(said.decode("utf-8", "replace"), folder), retry=False)
    return Path(options[-1])


def fault_of(said: str, folder: Path) -> str:
    """Return what a command says of its failure, without words about commands and the names of our files."""
    lines = [re.sub("^(realizer: |Error: )+", "", line) for line in said.splitlines()]
    lines = [line for line in lines if line and not re.match("Usage: |Try |see .* --help$", line)]
    # An option's name stands before its fault, once.
    lines = [re.sub(r"^(?:Invalid value for )?'?--([a-z]+)'?: (\1: )?", r"\1: ", line) for line in lines]
    lines = [re.sub(HINTS, "", line) for line in lines if str(folder) not in line]
    return "\n".join(lines[-20:]) or "the renderer ended"
