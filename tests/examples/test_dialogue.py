"""The dialogue example from outside: lines typed in; words, marks, interruptions and feedback out."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from bml_schema.behaviours import Head
from bml_schema.feedback import BlockProgress, Feedback, PredictionFeedback, SyncPointProgress
from realizer.client import Client, connect
from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.waiting import LIMIT

PROGRAM = Path(__file__).parents[2] / "examples" / "dialogue.py"

spec = spec_from_file_location("dialogue", PROGRAM)
assert spec is not None
assert spec.loader is not None
dialogue = module_from_spec(spec)
sys.modules["dialogue"] = dialogue
spec.loader.exec_module(dialogue)


class Console:
    """The example as it runs in a terminal."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        self.seen = ""

    async def until(self, text: str) -> str:
        """What it prints up to a text, since the last time."""
        assert self.process.stdout is not None
        while text not in self.seen:
            new = await self.process.stdout.read(1024)
            assert new, f"wanted {text!r}, it ended with {self.seen!r}"
            self.seen += new.decode()
        before, _, self.seen = self.seen.partition(text)
        return before + text

    async def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n".encode())
        await self.process.stdin.drain()

    async def end(self) -> str:
        """What else it prints when no line follows."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.stdout is not None
        rest = self.seen + (await self.process.stdout.read()).decode()
        assert await self.process.wait() == 0, rest
        return rest


def playing(test, *options: str) -> None:
    """Run a test against the example with these options."""

    async def run() -> None:
        pipe, out = asyncio.subprocess.PIPE, asyncio.subprocess.STDOUT
        command = [sys.executable, str(PROGRAM), *options]
        async with asyncio.timeout(LIMIT):
            process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe, stderr=out)
            try:
                await test(Console(process))
            finally:
                if process.returncode is None:
                    process.kill()
                    await process.wait()

    asyncio.run(run())


@asynccontextmanager
async def silent() -> AsyncIterator[Client]:
    """A client of a service of its own, whose voice makes no sound."""
    service = Server(Settings(port=0, voice="silent"))
    async with asyncio.timeout(LIMIT), service as server, connect(server.url) as client:
        yield client


def words(printed: str) -> list[str]:
    return re.findall(r"[\w']+", re.sub(r"\[.*?\]", "", printed))


STORY = words(next(iter(dialogue.SCRIPT.values())))


@pytest.mark.slow
def test_dialogue_goes_on_after_an_interruption() -> None:
    async def test(console: Console) -> None:
        await console.until("> ")
        await console.type("Tell me a story.")
        begun = words(await console.until("face"))
        assert begun == STORY[: len(begun)]
        await console.type("Hello?")
        begun += words(await console.until("-- silent"))[:-1]
        await console.until("-- last word: ")
        last = words(await console.until("\n"))[0]
        known = len(begun) - 1 if begun[-1] != last else len(begun)
        assert begun[known - 1] == last
        reply = await console.until("while I tell it.")
        assert f"I had said: {STORY[known - 2]} {last}." in reply
        assert "[smile] Hello! [nod] Ask me for a story" in reply
        await console.until("> ")
        await console.type("go on")
        rest = words(await console.until("wait"))
        assert rest == STORY[known : known + len(rest)], "no word is left out, none is said twice"
        await console.type("")
        await console.until("-- last word: ")
        await console.until("> ")
        assert "Traceback" not in await console.end()

    playing(test, "--voice", "silent")


MODEL = """
def reply(history):
    yield from ["Ye", "s, <b>", "[n", "od]that & this", " [", "smile] is [here] so", ". ", "[quiet"]
"""


@pytest.mark.slow
def test_dialogue_plays_tokens_on_a_running_service(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MODEL)
    feedback_of_turns: list[Feedback] = []

    async def test(console: Console, url: str) -> None:
        session = (await console.until("\n> ")).partition("?session=")[2].split()[0]
        async with connect(f"{url}?session={session}") as viewer:
            await console.type("Well?")
            feedback_of_turns.extend([feedback async for feedback in viewer.until_end("turn1")])
        printed = " ".join((await console.until("\n")).split())
        assert printed == "Yes, <b> [nod] that & this [smile] is [here] so. [quiet"
        assert (await console.end()).strip() == ">"

    async def served() -> None:
        async with Server(Settings(port=0, voice="silent")) as server:
            command = ("--service", server.url, "--model", f"{tmp_path / 'mine.py'}:reply")
            await asyncio.to_thread(playing, lambda console: test(console, server.url), *command)

    asyncio.run(served())
    assert isinstance(feedback_of_turns[-1], BlockProgress)
    assert feedback_of_turns[-1].status == "DONE"
    said = {
        f.id.partition(":")[2]: f.global_time for f in feedback_of_turns if isinstance(f, SyncPointProgress)
    }
    (nod,) = {
        node.id: node
        for feedback in feedback_of_turns
        if isinstance(feedback, PredictionFeedback)
        for node in feedback.behaviours
        if isinstance(node, Head)
    }.values()
    assert nod.id is not None
    assert (nod.lexeme, nod.id.partition(".")[0]) == ("NOD", "turn1")
    assert said[f"{nod.id.partition(':')[2]}:start"] == pytest.approx(said["turn1:s2"]), "where it stands"


def test_history_has_only_what_was_heard() -> None:
    def model(history: list[dict[str, str]]) -> Iterator[str]:
        yield "One two three. "
        if len(history) == 1:
            lines.put_nowait("But")
            yield "Four five six seven eight nine ten."

    lines: asyncio.Queue[str | Exception | None]

    async def run() -> list[dict[str, str]]:
        nonlocal lines
        lines = asyncio.Queue()
        async with silent() as client:
            lines.put_nowait("Go")
            talking = asyncio.create_task(dialogue.converse(client, model, lines))
            async with connect(f"{client.url}?session={client.session}") as viewer:
                async for _ in viewer.until_end("turn3"):
                    pass
            lines.put_nowait(None)
            history: list[dict[str, str]] = await talking
            return history

    history = asyncio.run(run())
    assert [message["role"] for message in history] == ["user", "assistant", "user", "assistant"]
    assert "ten" not in history[1]["content"]
    assert history[1]["content"].endswith(dialogue.CUT)
    assert history[3]["content"] == "One two three. "


@pytest.mark.parametrize(
    ("heard", "repeated"),
    [("It could not stop.", "not stop."), ("With pleasure, it", "pleasure, it."), ("", "nothing.")],
)
def test_scripted_repeats_the_last_words_as_one_sentence(heard: str, repeated: str) -> None:
    before = {"role": "assistant", "content": heard + dialogue.CUT}
    text = "".join(dialogue.scripted([before, {"role": "user", "content": "What?"}]))
    assert text.startswith(f"[surprise] Yes? I had said: {repeated} [raise_brows]")


def test_turn_goes_on_after_a_model_that_has_finished() -> None:
    async def run() -> list[str]:
        async with asyncio.timeout(LIMIT):
            cut = dialogue.Turn(None, "turn1", dialogue.flow(["One two ", "three."]))
            assert [word async for word in cut.words()] == ["One ", "two ", "three."]
            rest = dialogue.Turn(None, "turn3", cut.tokens, " three.")
            return [word async for word in rest.words()]

    assert asyncio.run(run()) == [" ", "three."]


@pytest.mark.parametrize(
    ("said", "was_heard"),
    [
        ("", ""),
        ("Well", "[joy] Well,"),
        ("Well don't", '[joy] Well, [nod] "don\'t!"'),
        ("Well don't stop", '[joy] Well, [nod] "don\'t!" [smile]stop.'),
    ],
)
def test_heard_ends_after_the_last_spoken_word(said: str, was_heard: str) -> None:
    text = '[joy] Well, [nod] "don\'t!" [smile]stop.'
    assert dialogue.heard(text, said) == (was_heard, text.removeprefix(was_heard))


def test_heard_takes_the_spoken_form_of_a_text() -> None:
    assert dialogue.heard("At 5 o'clock.", "At five") == ("At five", "At 5 o'clock.")


@contextmanager
def speaking_openai(bodies: list[dict[str, object]], *events: str) -> Iterator[str]:
    """A server of a model that answers with these events."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            bodies.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(200 if self.path == "/v1/chat/completions" else 404)
            self.end_headers()
            for event in events:
                self.wfile.write(f"data: {event}\n\n".encode())

        def log_message(self, format: str, *args: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/v1"
        server.shutdown()
        thread.join()


def test_model_at_an_address_gives_its_tokens() -> None:
    bodies: list[dict[str, object]] = []
    deltas = [{"role": "assistant", "content": None}, {"content": "Hel"}, {"content": "lo."}, {}]
    events = [json.dumps({"choices": [{"index": 0, "delta": delta}]}) for delta in deltas]
    with speaking_openai(bodies, *events, json.dumps({"choices": []}), "[DONE]") as url:
        tokens = list(dialogue.openai(url, "small")([{"role": "user", "content": "Hi"}]))
    assert "".join(tokens) == "Hello."
    (body,) = bodies
    assert (body["model"], body["stream"]) == ("small", True)
    assert body["messages"] == [
        {"role": "system", "content": dialogue.PROMPT},
        {"role": "user", "content": "Hi"},
    ]


def test_dialogue_ends_with_the_reason_of_a_failed_model() -> None:
    def model(history: list[dict[str, str]]) -> Iterator[str]:
        yield "One two three. Four"
        raise ConnectionRefusedError("no model listens there")

    async def run() -> None:
        async with silent() as client:
            await dialogue.converse(client, model, dialogue.flow(["Hi"]))

    with pytest.raises(ConnectionRefusedError, match="no model listens there"):
        asyncio.run(run())


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        (["--help"], 0, "interrupts it: the face stops at once"),
        (["--model", "none.py:reply"], 2, "wanted FILE.py:FUNCTION, there is no none.py:reply"),
        (["--service", "ws://127.0.0.1:1/ws"], 1, "dialogue: "),
    ],
)
def test_dialogue_prints_its_usage_and_errors(options: list[str], status: int, message: str) -> None:
    command = [sys.executable, str(PROGRAM), *options]
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=LIMIT)
    assert done.returncode == status
    assert message in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
