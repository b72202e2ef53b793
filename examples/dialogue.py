"""A dialogue manager: a model's text in as it comes, a face that says it, and a user who may break in.

  python examples/dialogue.py                     # a scripted model and a service of its own: no network
  python examples/dialogue.py --voice silent      # only the face, at a reader's pace
  python examples/dialogue.py --openai http://127.0.0.1:8080/v1 --name llama    # a model that runs there
  python examples/dialogue.py --model mine.py:reply     # def reply(history): yield "Hel"; yield "lo."

Type a line: the words of the answer appear as they are said, and the page whose address is printed shows and
sounds them. A line that you type while the face speaks interrupts it: it is silent at once, and the model
gets your line and as much of its own text as was heard. An empty line only silences it; "go on" lets it say
the rest. The end of input (Ctrl-D) ends the dialogue.

This file is the tutorial, read it from top to bottom. A model is a function of the history (the messages of
a chat) that yields tokens. In its text stand marks: [nod] [shake] [smile] and all other lexemes of the
service, [joy] and all its other emotions become behaviours that start where they stand, [pause] half a
second of silence. Every word and every mark, whatever its name, is also a sync point: the service tells when
it is said. When a speech is cut off, the service tells which words of it were heard.
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
import urllib.request
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from pathlib import Path
from xml.sax.saxutils import escape

from bml_schema.feedback import BlockProgress, SyncPointProgress
from realizer.client import Client, ClientError, connect
from realizer.core.errors import RealizerError

__all__ = ["converse", "flow", "heard", "openai", "scripted"]

History = list[dict[str, str]]
Model = Callable[[History], Iterable[str]]

# 1. Models: the history in, tokens out. They may block; a thread of their own draws from them.

SCRIPT = {  # what the user says -> what the model says
    r"\b(story|tell)\b": """[joy] With pleasure. Once there was a face that could not stop. [sadness] When
        somebody called "wait", [shake] it talked on to the end of its text. [pause] Then it learned
        [raise_brows] to listen: every word it said left a trace, [nod] and when it was interrupted, it knew
        which one had been the last. [moral] So it said nothing twice, [smile] and was good company.""",
    r"\b(hello|hi|hey)\b": "[smile] Hello! [nod] Ask me for a story, and interrupt me while I tell it.",
    r"\b(bye|thanks?)\b": "[joy] It was a pleasure. [nod] Goodbye!",
    r"": '[raise_brows] I only know a story. Say "tell me", or "go on" where you stopped me.',
}
CUT = " ..."  # ends a text of the history that was not heard to its end
PROMPT = """You are a face that speaks with somebody. Answer in a few short sentences of plain text. Put marks
before words they belong to: [nod] [shake] [smile] [raise_brows] [pause] [joy] [sadness] [anger] [surprise].
A text of yours that ends with "..." was interrupted: the user has heard only what stands there."""


def scripted(history: History) -> Iterator[str]:
    """A model that needs no network. Its tokens end within words and marks, as those of others do."""
    said = history[-1]["content"].lower()
    text = " ".join(next(text for words, text in SCRIPT.items() if re.search(words, said)).split())
    if len(history) > 1 and (before := history[-2]["content"]).endswith(CUT):
        text = f"[surprise] Yes? I had said: {' '.join(before.split()[-3:-1])}. {text}"
    for at in range(0, len(text), 4):
        time.sleep(0.01)
        yield text[at : at + 4]


def openai(url: str, name: str) -> Model:
    """A model that speaks OpenAI's protocol at an address, as servers of local models do."""

    def model(history: History) -> Iterator[str]:
        messages = [{"role": "system", "content": PROMPT}, *history]
        body = json.dumps({"model": name, "stream": True, "messages": messages}).encode()
        headers = {"Content-Type": "application/json"}
        if key := os.environ.get("OPENAI_API_KEY"):
            headers["Authorization"] = f"Bearer {key}"
        request = urllib.request.Request(f"{url.rstrip('/')}/chat/completions", body, headers)
        with urllib.request.urlopen(request, timeout=60) as events:
            for line in events:
                if line.startswith(b"data: {"):
                    for choice in json.loads(line[6:])["choices"]:
                        yield choice["delta"].get("content") or ""

    return model


# 2. What blocks, such as a model or a keyboard, becomes a queue.

Flow = asyncio.Queue[str | Exception | None]


def flow(blocking: Iterable[str]) -> Flow:
    """Draw from it in a thread; at the end comes None, or the exception that it ended with."""
    loop, queue = asyncio.get_running_loop(), Flow()

    def draw() -> None:
        end: Exception | None = None
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody listens any more
            try:
                for one in blocking:
                    loop.call_soon_threadsafe(queue.put_nowait, one)
            except Exception as error:
                end = error
            loop.call_soon_threadsafe(queue.put_nowait, end)

    threading.Thread(target=draw, daemon=True).start()
    return queue


async def taken(queue: Flow) -> str | None:
    """The next of it, None at its end."""
    one = await queue.get()
    if isinstance(one, Exception):
        raise one
    return one


# 3. A turn: text with marks becomes a speech with behaviours and syncs in it.


class Turn:
    """What the character says at a time: `text`, which is there, and the tokens that follow it."""

    def __init__(self, client: Client, id: str, tokens: Flow, text: str = "") -> None:
        self.client, self.id, self.tokens, self.text = client, id, tokens, text
        self.syncs: list[str] = []  # what stands at the syncs s0, s1, ... of the speech

    async def words(self) -> AsyncIterator[str]:
        """Whole words, each as soon as the blank behind it has come."""
        *whole, rest = re.split(r"(?<=\s)", self.text)
        while True:
            for word in whole:
                yield word
            if (token := await taken(self.tokens)) is None:
                break
            self.text += token
            *whole, rest = re.split(r"(?<=\s)", rest + token)
        yield rest

    def marked(self, word: str) -> str:
        """A word and its marks as the service takes them: with syncs; < and & are no markup."""
        can, parts = self.client.welcome["capabilities"], []
        for part in re.split(r"(\[[\w-]+\])", word):
            if part.strip():
                parts.append(f'<sync id="s{len(self.syncs)}"/>')
                self.syncs.append(part.strip())
            mark = part[1:-1] if re.fullmatch(r"\[[\w-]+\]", part) else None
            if mark is None:
                parts.append(escape(part))
            elif mark == "pause":
                parts.append('<break time="500ms"/>')
            elif mark in can["emotions"]:
                parts.append(f'<realizer:emotion name="{mark}"/>')
            else:
                kinds = [kind for kind, lexemes in can["lexemes"].items() if mark.upper() in lexemes]
                parts += [f'<{kind} lexeme="{mark.upper()}"/>' for kind in kinds[:1]]
        return "".join(parts)

    async def speak(self) -> None:
        """Say the text as it comes. Leaving `async with` closes the speech, an exception stops it."""
        async with self.client.speech(self.id) as speech:
            async for word in self.words():
                await speech.append(self.marked(word))

    async def show(self) -> BlockProgress:
        """Print words and marks when they are said, until the speech ends; what told the end."""
        async for told in self.client.until_end(self.id):
            match told:
                case SyncPointProgress() if found := re.fullmatch(rf".*:{self.id}:s(\d+)", told.id):
                    print(self.syncs[int(found[1])], end=" ", flush=True)
                case BlockProgress() if told.id == f"{self.id}:end":
                    return told
        raise ClientError(f"the service did not say {self.id} to its end")


def heard(text: str, said: str) -> tuple[str, str]:
    """A text divided behind the last word of it that was said."""
    between = r"(?:\[[\w-]+\]|\W)"
    words = f"{between}+".join(map(re.escape, said.split()))
    found = re.match(rf"{between}*{words}[^\w\s\[]*", text) if words else None
    return (found[0], text[found.end() :]) if found else (said, text)


# 4. The dialogue: a turn goes on to its end, or until the user types a line.


async def converse(client: Client, model: Model, lines: Flow) -> History:
    """Answer the user's lines until there are no more; what was said, as it was heard."""
    history: History = []
    left: Turn | None = None  # what was not said because the user broke in
    hearing = asyncio.create_task(taken(lines))
    while True:
        print("\n> ", end="", flush=True)
        if (line := await hearing) is None:
            return history
        hearing = asyncio.create_task(taken(lines))
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
            speaking.result()  # where the model failed, this says so
        said = turn.text
        if end.status != "DONE":
            said, rest = heard(turn.text, end.said or "")
            said, left = said + CUT, Turn(client, id, turn.tokens, rest)
            print(f"-- last word: {end.last_word or 'none'}", end=" ")
            await client.send(f'<bml id="ear-{id}"><faceLexeme id="f" lexeme="RAISE_BROWS"/></bml>')
        history.append({"role": "assistant", "content": said})


async def run(url: str | None, voice: str | None, model: Model) -> None:
    """Converse with who types, over the service at an address, or over one of our own."""
    async with contextlib.AsyncExitStack() as stack:
        if url is None:
            from realizer.core.settings import Settings
            from realizer.server.serve import Server  # a client alone does without

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
    parser.add_argument("--service", metavar="URL", help="a service that runs, as ws://127.0.0.1:8765/ws")
    parser.add_argument("--voice", help="of our own service, see `realizer voices`; the first that is there")
    parser.add_argument("--openai", metavar="URL", help="of a model; OPENAI_API_KEY where it wants a key")
    parser.add_argument("--name", default="default", help="of the model there")
    parser.add_argument("--model", metavar="FILE.py:FUNCTION", help="a model of yours, as above")
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
