"""A dialogue manager: a face speaks the text of a model while it is generated, and the user can interrupt.

  python examples/dialogue.py                     # a scripted model and its own service: no network
  python examples/dialogue.py --voice silent      # only the face, at reading speed
  python examples/dialogue.py --openai http://127.0.0.1:8080/v1 --name llama    # a model on a server
  python examples/dialogue.py --model mine.py:reply     # def reply(history): yield "Hel"; yield "lo."

Type a line: the words of the answer are printed when they are spoken, and the page at the printed address
shows the face and plays the sound. A line typed while the face speaks interrupts it: the face stops at once,
and the model gets the line and the part of its own text that was heard. An empty line only stops the face;
"go on" makes it speak the rest. The end of input (Ctrl-D) ends the dialogue.

This file is a tutorial; read it from top to bottom. A model is a function that takes the history (the
messages of a chat) and yields tokens. Its text may contain Markdown and marks, which the service reads:
lexemes such as [nod], [shake] and [smile], and emotions such as [joy], become behaviours that start at
this place; [pause] is half a second of silence. Every word and every mark is also a sync point, so the
service reports when it is spoken. When a speech is interrupted, the service reports which words were heard.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import re
import runpy
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from pathlib import Path

from bml_schema.feedback import BlockProgress, SyncPointProgress
from realizer.client import Client, ClientError, connect
from realizer.core.errors import RealizerError

__all__ = ["converse", "flow", "heard", "openai", "scripted"]

History = list[dict[str, str]]
Model = Callable[[History], Iterable[str]]

# 1. Models take the history and yield tokens. They may block, as each runs in a thread of its own.

SCRIPT = {  # what the user says -> what the model says
    r"\b(story|tell)\b": """[joy] With pleasure. Once there was a face that could not stop. [sadness] When
        somebody called "wait", [shake] it talked on to the end of its text. [pause] Then it learned
        [raise_brows] to listen: every word it said left a trace, [nod] and when it was interrupted, it knew
        which one had been the last. [pause] So it said nothing twice, [smile] and was good company.""",
    r"\b(hello|hi|hey)\b": "[smile] Hello! [nod] Ask me for a story, and interrupt me while I tell it.",
    r"\b(bye|thanks?)\b": "[joy] It was a pleasure. [nod] Goodbye!",
    r"": '[raise_brows] I only know a story. Say "tell me", or "go on" where you stopped me.',
}
CUT = " ..."  # the end of an interrupted text in the history
PROMPT = """You are a face that talks to a user. Answer in a few short sentences of plain text. Put marks
before words they belong to: [nod] [shake] [smile] [raise_brows] [pause] [joy] [sadness] [anger] [surprise].
An answer of yours that ends with "..." was interrupted: the user has heard only this part of it."""


def scripted(history: History) -> Iterator[str]:
    """Answer by a script, without a network; tokens end within words and marks, as those of models do."""
    said = history[-1]["content"].lower()
    text = " ".join(next(text for words, text in SCRIPT.items() if re.search(words, said)).split())
    if len(history) > 1 and (before := history[-2]["content"]).endswith(CUT):
        last = " ".join(before.split()[-3:-1]).rstrip(".,;:!?") or "nothing"
        text = f"[surprise] Yes? I had said: {last}. {text}"
    for at in range(0, len(text), 4):
        time.sleep(0.01)
        yield text[at : at + 4]


def openai(url: str, name: str) -> Model:
    """Return a model on a server with OpenAI's protocol, which servers of local models support too."""

    def model(history: History) -> Iterator[str]:
        messages = [{"role": "system", "content": PROMPT}, *history]
        body = json.dumps({"model": name, "stream": True, "messages": messages}).encode()
        headers = {"Content-Type": "application/json"}
        if key := os.environ.get("OPENAI_API_KEY"):
            headers["Authorization"] = f"Bearer {key}"
        request = urllib.request.Request(f"{url.rstrip('/')}/chat/completions", body, headers)
        try:
            events = urllib.request.urlopen(request, timeout=60)
        except urllib.error.URLError as error:
            raise OSError(f"--openai {url}: {error.reason}") from None
        with events:
            for line in events:
                if line.startswith(b"data: {"):
                    for choice in json.loads(line[6:])["choices"]:
                        yield choice["delta"].get("content") or ""

    return model


# 2. Blocking iterables, such as a model or the keyboard, become queues.

Flow = asyncio.Queue[str | Exception | None]


def flow(blocking: Iterable[str]) -> Flow:
    """Return a queue of the items, which a thread reads; None or an exception marks the end."""
    loop, queue = asyncio.get_running_loop(), Flow()

    def draw() -> None:
        end: Exception | None = None
        with contextlib.suppress(RuntimeError):  # the loop is closed
            try:
                for item in blocking:
                    loop.call_soon_threadsafe(queue.put_nowait, item)
            except Exception as error:
                end = error
            loop.call_soon_threadsafe(queue.put_nowait, end)

    threading.Thread(target=draw, daemon=True).start()
    return queue


async def next_item(queue: Flow) -> str | None:
    """Return the next item of a queue, or None at its end, also when it is read again there."""
    item = await queue.get()
    if item is None:
        queue.put_nowait(None)  # "go on" reads the end again
    if isinstance(item, Exception):
        raise item
    return item


# 3. A turn: text with marks becomes a speech with behaviours and sync points.


class Turn:
    """An answer of the character: `text`, which has arrived, and the tokens that follow it."""

    def __init__(self, client: Client, id: str, tokens: Flow, text: str = "") -> None:
        self.client, self.id, self.tokens, self.text = client, id, tokens, text
        self.syncs: list[str] = []  # the word or mark at each sync point s0, s1, ... of the speech

    async def words(self) -> AsyncIterator[str]:
        """Yield whole words, each as soon as the blank after it has arrived."""
        *whole, rest = re.split(r"(?<=\s)", self.text)
        while True:
            for word in whole:
                yield word
            if (token := await next_item(self.tokens)) is None:
                break
            self.text += token
            *whole, rest = re.split(r"(?<=\s)", rest + token)
        yield rest

    def marked(self, word: str) -> str:
        """Return a word and its marks with a sync point before each; the service reads the marks."""
        parts = []
        for part in re.split(r"(\[[\w-]+\])", word):
            if part.strip():
                parts.append(f'<sync id="s{len(self.syncs)}"/>')
                self.syncs.append(part.strip())
            parts.append(part)
        return "".join(parts)

    async def speak(self) -> None:
        """Speak the text as it arrives. `async with` closes the speech; an exception stops it."""
        async with self.client.speech(self.id) as speech:
            async for word in self.words():
                await speech.append(self.marked(word))

    async def show(self) -> BlockProgress:
        """Print words and marks when they are spoken, and return the feedback for the end of the speech."""
        async for feedback in self.client.until_end(self.id):
            match feedback:
                case SyncPointProgress() if found := re.fullmatch(rf".*:{self.id}:s(\d+)", feedback.id):
                    print(self.syncs[int(found[1])], end=" ", flush=True)
                case BlockProgress() if feedback.id == f"{self.id}:end":
                    return feedback
        raise ClientError(f"the service did not finish {self.id}")


def heard(text: str, said: str) -> tuple[str, str]:
    """Split a text after its last word in `said`, the spoken words."""
    between = r"(?:\[[\w-]+\]|\W)"
    words = f"{between}+".join(map(re.escape, said.split()))
    found = re.match(rf"{between}*{words}[^\w\s\[]*", text) if words else None
    return (found[0], text[found.end() :]) if found else (said, text)


# 4. The dialogue: a turn ends by itself, or when the user types a line.


async def converse(client: Client, model: Model, lines: Flow) -> History:
    """Answer the user's lines until the input ends, and return the history as it was heard."""
    history: History = []
    left: Turn | None = None  # the rest of an interrupted turn
    hearing = asyncio.create_task(next_item(lines))
    while True:
        print("\n> ", end="", flush=True)
        if (line := await hearing) is None:
            return history
        hearing = asyncio.create_task(next_item(lines))
        if not (line := line.strip()):
            continue
        history.append({"role": "user", "content": line})
        id = f"turn{len(history)}"
        if left is not None and line.lower() == "go on":
            turn, left = Turn(client, id, left.tokens, left.text), None
        else:
            turn = Turn(client, id, flow(model(history)))
        speaking, showing = asyncio.create_task(turn.speak()), asyncio.create_task(turn.show())
        await asyncio.wait({showing, hearing}, return_when=asyncio.FIRST_COMPLETED)
        if not showing.done() and await hearing is not None:
            began = time.perf_counter()
            await client.control("stop", blocks=[id])
            speaking.cancel()
            await showing
            print(f"-- silent after {1000 * (time.perf_counter() - began):.1f} ms", end=" ")
        end = await showing
        await asyncio.wait({speaking})
        if not speaking.cancelled():
            speaking.result()  # raises the exception of a failed model
        said = turn.text
        if end.status != "DONE":
            said, rest = heard(turn.text, end.said or "")
            said, left = said + CUT, Turn(client, id, turn.tokens, rest)
            print(f"-- last word: {end.last_word or 'none'}", end=" ")
            await client.send(f'<bml id="ear-{id}"><faceLexeme id="f" lexeme="RAISE_BROWS"/></bml>')
        history.append({"role": "assistant", "content": said})


async def run(url: str | None, voice: str | None, model: Model) -> None:
    """Converse with the user over the service at an address, or over a service of this process."""
    async with contextlib.AsyncExitStack() as stack:
        if url is None:
            from realizer.core.settings import Settings
            from realizer.server.serve import Server  # not needed by a client alone

            settings = Settings.read({"port": 0, "voice": voice})
            url = (await stack.enter_async_context(Server(settings))).url
        client = await stack.enter_async_context(connect(url))
        page = url.partition("?")[0].removesuffix("/ws").replace("ws", "http", 1)
        print(f"look and listen: {page}/?session={client.session}")
        await converse(client, model, flow(sys.stdin))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, usage="%(prog)s [options]", formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--service", metavar="URL", help="address of a running service, such as ws://127.0.0.1:8765/ws"
    )
    parser.add_argument(
        "--voice", help="voice of the own service, see `realizer voices`; default: the first installed"
    )
    parser.add_argument(
        "--openai", metavar="URL", help="address of a model; the variable OPENAI_API_KEY is its key"
    )
    parser.add_argument("--name", default="default", help="name of the model there")
    parser.add_argument("--model", metavar="FILE.py:FUNCTION", help="your own model, as above")
    given = parser.parse_args()
    model: Model = openai(given.openai, given.name) if given.openai else scripted
    if given.model:
        file, _, function = given.model.rpartition(":")
        if not Path(file).is_file() or (found := runpy.run_path(file).get(function)) is None:
            parser.error(f"--model: wanted FILE.py:FUNCTION, there is no {given.model}")
        model = found
    try:
        asyncio.run(run(given.service, given.voice, model))
    except KeyboardInterrupt:
        print()
    except (OSError, RealizerError) as error:
        sys.exit(f"dialogue: {error}")


if __name__ == "__main__":
    main()
