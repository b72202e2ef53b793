"""Write what one checkout does with many inputs, for `compare_checkouts.py`.

    python benchmarks/checkout_outputs.py PART OLD TREE

does a part (see there) with the documents of the checkout OLD and writes files below the folder TREE.
PYTHONPATH names the checkout that does it. Only the command line, the wire and public names of `realizer`
are used.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

__all__ = ["PARTS"]

FOLDERS = ("realizer/examples", "tests/corpus", "examples")
FILMED = ("1-greeting.bml", "4-emotional-turn.bml")
TARGETS = (
    "/asyncapi.json",
    "/examples.json",
    "/vocabulary.json",
    "/healthz",
    "/look.json",
    "/mirror?light=evening",
    "/look.json?face=nobody",
    "/faces/default",
    "/faces/ada",
    "/faces/nobody",
    "/feeling.json?of=joy",
    "/feeling.json?of=nothing",
    "/pose.fap?set=%7B%22aus%22:%7B%2212%22:0.5%7D%7D",
    "/metrics",
    "/nothing",
)
SHAPES = {
    "open_jaw": "jawOpen",
    "close_t_l_eyelid": "eyeBlinkLeft",
    "close_t_r_eyelid": "eyeBlinkRight",
    "raise_l_cornerlip": "mouthSmileLeft",
    "raise_r_cornerlip": "mouthSmileRight",
    "raise_l_i_eyebrow": "browInnerUp",
    "raise_l_o_eyebrow": "browOuterUpLeft",
    "raise_r_o_eyebrow": "browOuterUpRight",
}
NUMBERS = ("fap", "au", "arkit")
CONTROLS = (
    '{"type":"hello","version":1}',
    '{"type":"hello","version":99}',
    '{"type":"ping","id":7}',
    '{"type":"state"}',
    '{"type":"scene","objects":{"cup":{"x":0.2,"y":-0.1,"z":0.5}}}',
    '{"type":"scene","objects":{"cup":[1,2]}}',
    '{"type":"character","id":"Ada","face":"ada","voice":"silent"}',
    '{"type":"character","id":"Bob","face":"nobody"}',
    '{"type":"subscribe","stream":"fap","encoding":"json","fps":5}',
    '{"type":"subscribe","stream":"au","encoding":"json","fps":5,"asked":true}',
    '{"type":"subscribe","stream":"mesh","fps":2,"character":"Ada"}',
    '{"type":"subscribe","stream":"smell"}',
    '{"type":"subscribe","stream":"video","camera":"nowhere"}',
    '{"type":"subscribe","stream":"feedback","elements":["blockProgress"]}',
    '{"type":"set","emotion":{"name":"joy"},"aus":{"12L":0.5},"faps":{"open_jaw":200}}',
    '{"type":"set","aus":{"99":0.5}}',
    '{"type":"anticipate","id":"clock","syncs":{"beat":12}}',
    '<bml id="c1"><gaze id="g" target="cup" start="anticipators:clock:beat"/></bml>',
    '{"type":"anticipate","id":"clock","syncs":{"beat":9.5}}',
    '{"type":"speech","id":"s","append":"Hello there, "}',
    '{"type":"speech","id":"s","append":"how are you?"}',
    '{"type":"speech","id":"s","close":true}',
    '{"type":"state"}',
    '{"type":"stop","blocks":["c1"]}',
    '{"type":"stop"}',
    '{"type":"set","emotion":null,"aus":null,"faps":null}',
    '{"type":"unsubscribe","stream":"fap"}',
    '{"type":"unsubscribe","stream":"fap"}',
    '{"type":"nothing"}',
    '{"type":',
    "neither BML nor JSON",
    '<bml id="broken"><head id="h"></bml><bml id="whole"><head id="h" lexeme="NOD"/></bml>',
    b"\x09nonsense",
    '{"type":"state"}',
)


class Case(NamedTuple):
    """A document of OLD: its name in the trees, its file, and what its .toml says."""

    name: str
    path: Path
    wanted: dict[str, Any]


def cases_of(old: Path) -> list[Case]:
    """Return all documents of a checkout."""
    found = []
    for folder in FOLDERS:
        for path in sorted((old / folder).rglob("*")):
            if path.suffix in (".bml", ".xml"):
                toml = path.with_suffix(".toml")
                wanted = tomllib.loads(toml.read_text("utf-8")) if toml.is_file() else {}
                name = path.relative_to(old).with_suffix("").as_posix().removeprefix("tests/")
                found.append(Case(name.removeprefix("realizer/"), path, wanted))
    return found


class Tree:
    """The files that one checkout writes; of the paths that are in them only what both have in common.

    Args:
        old: the checkout whose documents are read.
        folder: where the files go.
    """

    def __init__(self, old: Path, folder: Path) -> None:
        self.folder = folder
        self.hidden = {str(folder): b"TREE", str(old): b"CHECKOUT", os.environ["PYTHONPATH"]: b"CHECKOUT"}

    def put(self, name: str, content: str | bytes) -> None:
        """Write a file."""
        path = self.folder / name
        content = content.encode() if isinstance(content, str) else content
        path.parent.mkdir(parents=True, exist_ok=True)
        for hidden, instead in self.hidden.items():
            content = content.replace(hidden.encode(), instead)
        path.write_bytes(content)


def called(*arguments: str | Path) -> str:
    """Call the command line in this process; return its output, exit status and messages."""
    from realizer.__main__ import main

    out, err, status = io.StringIO(), io.StringIO(), 0
    before, sys.argv = sys.argv, ["realizer", *map(str, arguments)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    finally:
        sys.argv = before
    messages = "".join(f"stderr: {line}\n" for line in err.getvalue().splitlines())
    return f"{out.getvalue()}\nexit status {status}\n{messages}"


def batch(old: Path, tree: Tree) -> None:
    """Write all documents in the cheap formats, and two in all formats."""
    how = ["--media", str(old / "tests/corpus/media"), "--workers", "1", "--size", "256x256"]
    outputs = re.findall(r"^\.(\S+)", called("outputs"), re.MULTILINE)
    films = [str(old / "realizer/examples" / name) for name in FILMED]
    for name, places, formats in (
        ("documents", [str(old / folder) for folder in FOLDERS], ["json", "fap", "csv", "vtt", "wav"]),
        ("films", films, outputs),
    ):
        folder = tree.folder / "batch" / name
        places = [place for place in places if Path(place).is_file() or _documents_in(Path(place))]
        chosen = [part for suffix in formats for part in ("--format", suffix)]
        command = [sys.executable, "-m", "realizer", "-q", "batch", *places, "-o", str(folder), *chosen]
        done = subprocess.run([*command, *how], capture_output=True, text=True, check=False)
        tree.put(f"batch/{name}.txt", f"exit status {done.returncode}\n")
        manifest = folder / "manifest.jsonl"
        rows = [json.loads(line) for line in manifest.read_text("utf-8").splitlines()]
        for row in rows:
            del row["key"]  # depends on the program's files
            row["outputs"] = [output["file"] for output in row["outputs"].values()]
        manifest.write_text("".join(json.dumps(row) + "\n" for row in rows), "utf-8")


def _documents_in(folder: Path) -> bool:
    return any(path.suffix in (".bml", ".xml") for path in folder.rglob("*"))


def commands(old: Path, tree: Tree) -> None:
    """Write what the commands print."""
    media = ("--media", old / "tests/corpus/media")
    for case in cases_of(old):
        tree.put(f"commands/{case.name}.schedule.json", called("schedule", case.path, "--json", *media))
        tree.put(f"commands/{case.name}.schedule.bml", called("schedule", case.path, "--bml", *media))
        tree.put(f"commands/{case.name}.check", called("check", case.path, *media))
        if "scene" in case.wanted:
            scene = tree.folder / "scene.json"
            scene.write_text(json.dumps(case.wanted["scene"]))
            tree.put(
                f"commands/{case.name}.scene.json", called("realize", case.path, "--scene", scene, *media)
            )
    examples, out = sorted((old / "realizer/examples").glob("*.bml")), tree.folder / "commands"
    tree.put("commands/together.schedule", called("schedule", "--json", "--detail", *examples))
    tree.put("commands/together.log", called("-q", "realize", *examples, "-o", out / "together.json"))
    picture = (examples[0], "--at", "1.2", "--size", "256x256", "--seed", "3", "-o", out / "at.png")
    tree.put("commands/at.log", called("-q", "realize", *picture))
    tree.put("commands/together-fap.log", called("-q", "realize", *examples, "-o", out / "together.fap"))
    for words in (("outputs",), ("voices",), ("faces", "list"), ("faces", "check"), ("expressions", "list")):
        tree.put(f"commands/{'-'.join(words)}.list", called(*words))
    for words in (
        ("--version",),
        ("faces", "mapping", "ada"),
        ("emotion", "guilty", "--json"),
        ("emotion", "joy"),
        ("emotion", "xyzzy"),
        ("enrich", "Are you sure? I am so happy that you came! No, I hate it."),
        ("expressions", "find", "joy"),
        ("fap", "info", out / "together.fap"),
        ("fap", "convert", out / "together.fap", "-o", out / "slow.fap", "--fps", "10"),
        ("realize", "missing.bml"),
        ("realize", examples[0], "--face", "nobody"),
        ("realize", examples[0], "-o", "x.unknown"),
        ("realize", examples[0], "--fps", "0"),
        ("nothing",),
    ):
        tree.put(f"commands/{'-'.join(Path(word).name for word in words)}", called(*words))
    tree.put("commands/options", "".join(options_of(())))


def options_of(command: tuple[str, ...]) -> Iterator[str]:
    """Yield a line with all options of a command, and those of its subcommands."""
    words = called(*command, "--help")
    columns = "\n".join(re.findall(r"^ {2,6}(-.*?)(?: {2}|$)", words, re.MULTILINE))
    options = sorted(set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", columns)))
    yield f"{' '.join([*command, *options])}\n"
    for name in re.findall(r"^  ([a-z]+)  ", words.partition("Commands:")[2], re.MULTILINE):
        yield from options_of((*command, name))


def faces(old: Path, tree: Tree) -> None:
    """Make faces: by zones, of a head with ARKit's shapes, and from the CC0 data where there are any."""
    folder = tree.folder / "faces"
    folder.mkdir()
    head = folder / "head.glb"
    example = old / "realizer/examples" / FILMED[0]
    tree.put("faces/head.log", called("-q", "realize", example, "-o", head))
    head.write_bytes(_renamed(head.read_bytes()))
    tree.put("faces/import.log", called("faces", "import", head, "-o", folder / "imported"))
    zones = ("faces", "zones", "ada", "-o", folder / "zones", "--xml", folder / "zones.xml")
    tree.put("faces/zones.log", called(*zones))
    tree.put(
        "faces/sheet.log", called("-q", "faces", "sheet", "ada", "--emotions", "-o", folder / "sheet.png")
    )
    if data := os.environ.get("FACE_DATA"):
        (folder / "ada").mkdir()
        shutil.copy(old / "faces/ada/recipe.toml", folder / "ada")
        tree.put("faces/build.log", called("faces", "build", "ada", "--data", data, "-o", folder / "ada"))


def _renamed(glb: bytes) -> bytes:
    """Give some of the shapes of a GLB the names that ARKit has for them."""
    size = int.from_bytes(glb[12:16], "little")
    text = glb[20 : 20 + size].rstrip()
    for ours, theirs in SHAPES.items():
        text = text.replace(f'"{ours}"'.encode(), f'"{theirs}"'.encode())
    text += b" " * (-len(text) % 4)
    rest = glb[20 + size :]
    head = glb[:8] + (20 + len(text) + len(rest)).to_bytes(4, "little")
    return head + len(text).to_bytes(4, "little") + glb[16:20] + text + rest


async def play(
    tree: Tree,
    url: str,
    name: str,
    sent: Sequence[tuple[float, str | bytes]],
    end: float,
    viewers: dict[str, Sequence[dict[str, Any]]],
) -> None:
    """Send messages to a session at their times and write what each of its connections gets.

    Args:
        sent: (seconds from the beginning, message); they go by the first of `viewers`.
        end: when to leave, seconds from the beginning.
        viewers: connection -> its subscriptions.
    """
    from websockets.asyncio.client import ClientConnection, connect

    got: dict[str, list[str]] = defaultdict(list)

    async def read(viewer: str, socket: ClientConnection) -> None:
        async for message in socket:
            got[f"{viewer}.{_kind(message)}"].append(message.hex() if isinstance(message, bytes) else message)

    loop = asyncio.get_running_loop()
    session = re.sub(r"[^A-Za-z0-9._~-]", ".", name)[-64:]
    async with contextlib.AsyncExitStack() as stack:
        sockets, readers = [], []
        for viewer, streams in viewers.items():
            one = connect(f"{url}?session={session}", compression=None, max_size=None)
            socket = await stack.enter_async_context(one)
            sockets.append(socket)
            readers.append(asyncio.create_task(read(viewer, socket)))
            for stream in streams:
                await socket.send(json.dumps({"type": "subscribe", **stream}))
        began = loop.time()
        for at, message in sent:
            await _until(loop, began + at)
            await sockets[0].send(message)
        await _until(loop, began + end)
    await asyncio.gather(*readers)
    for kind, messages in got.items():
        tree.put(f"live/{name}/{kind}", "".join(f"{message}\n" for message in messages))


async def _until(loop: asyncio.AbstractEventLoop, when: float) -> None:
    reached = loop.create_future()
    loop.call_at(when, reached.set_result, None)
    await reached


def _kind(message: str | bytes) -> str:
    """Return what messages of a stream have in common: the file they are written to."""
    if isinstance(message, bytes):
        return f"kind{message[0]}.{message[2]}"  # and the character's index
    return "feedback" if message.startswith("<") else f"json.{json.loads(message)['type']}"


def documents_of(case: Case) -> list[tuple[float, str | bytes]]:
    """Return the documents of a case with the times at which it sends them."""
    content = case.path.read_bytes()
    if len(times := case.wanted.get("sent", [])) < 2:
        return [(float(times[0]) if times else 0.0, _text(content))]
    first, *parts = re.split(rb"(?=<(?:\w+:)?bml[\s>])", content)
    parts[:1] = [first + parts[0]]
    return [(float((times + [0] * len(parts))[k]), _text(part)) for k, part in enumerate(parts)]


def _text(content: bytes) -> str:
    return content.decode("utf-8-sig", "replace")


async def lively(old: Path, tree: Tree) -> None:
    """Play all documents, the examples with all streams, and the control messages; ask for pages."""
    from virtual_clock import service

    cases = cases_of(old)
    media = old / "tests/corpus/media"
    async with service(media=media, seed=5) as url:
        await http(tree, url)
        few = {"c": [{"stream": "fap", "fps": 10}, {"stream": "schedule"}]}
        for k in range(0, len(cases), 64):  # so many sessions side by side
            playing = []
            for case in cases[k : k + 64]:
                sent = sorted(documents_of(case), key=lambda one: one[0])
                if "scene" in case.wanted:
                    objects = {name: list(place) for name, place in case.wanted["scene"].items()}
                    sent.insert(0, (0.0, json.dumps({"type": "scene", "objects": objects})))
                playing.append(play(tree, url, case.name, sent, sent[-1][0] + 8, few))
            await asyncio.gather(*playing)
        texts = [_text(path.read_bytes()) for path in sorted((old / "realizer/examples").glob("*.bml"))]
        views: dict[str, Sequence[dict[str, Any]]] = {
            "sender": [],
            "binary": [
                *({"stream": name, "encoding": "binary", "fps": 25} for name in NUMBERS),
                {"stream": "mesh", "fps": 5},
                {"stream": "audio"},
                {"stream": "video", "fps": 2, "size": [128, 128]},
            ],
            "json": [{"stream": name, "encoding": "json"} for name in (*NUMBERS, "schedule")],
        }
        await play(tree, url, "all", [(6.0 * k + 0.513, text) for k, text in enumerate(texts)], 40, views)
        clip = b"\x04\x01" + bytes(30)
        controls = [(0.51 * k + 0.2, message) for k, message in enumerate((*CONTROLS, clip))]
        await play(tree, url, "controls", controls, 30, {"c": []})


async def http(tree: Tree, url: str) -> None:
    """Write what the service answers to GET; not the Date, and of metrics only the names."""
    port = int(url.split(":")[2].partition("/")[0])
    for target in TARGETS:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(f"GET {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode())
        answer = await reader.read()
        writer.close()
        if target == "/metrics":
            answer = re.sub(rb"(?m)^(# HELP \w+).*|^(\w+).* \S+$", rb"\1\2", answer)
        answer = re.sub(rb"Content-Length: \d+\r\n", b"", answer)  # the checkout's path may be in it
        tree.put(f"live/GET{re.sub(r'[^A-Za-z0-9.]', '_', target)}", answer)


def live(old: Path, tree: Tree) -> None:
    """Run the part of that name."""
    from virtual_clock import run

    run(lively(old, tree))


def service(old: Path, tree: Tree) -> None:
    """Write what a service with a real clock does; times and ports are left out."""
    from websockets.sync.client import connect

    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--xface-port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        lines = [process.stdout.readline()]
        while not (found := re.search(r"ws://\S+/ws", "".join(lines))) and lines[-1]:
            lines.append(process.stdout.readline())
        assert found, f"the service did not start: {lines}"
        frames = []
        with connect(found[0], max_size=None) as socket:
            socket.send('{"type":"hello","version":1}')
            for stream in ("fap", "au", "arkit"):
                socket.send(json.dumps({"type": "subscribe", "stream": stream, "fps": 25}))
            until = time.monotonic() + 30
            while time.monotonic() < until:
                message = socket.recv(30)
                if isinstance(message, str):
                    tree.put(
                        f"service/{_kind(message)}", re.sub(r'"(time|frame|session)": ?[^,}]+', "", message)
                    )
                elif 50 <= (number := int.from_bytes(message[4:8], "little")) < 75:
                    frames.append(f"{message[0]} {number} {message.hex()}\n")
                elif number >= 75:
                    break
        process.terminate()
        printed = "".join(lines) + process.stdout.read()
    tree.put("service/idle", "".join(sorted(frames)))
    tree.put("service/printed", re.sub(r":\d+|port \d+", ":PORT", printed) + f"{process.returncode}\n")


PARTS: dict[str, Callable[[Path, Tree], None]] = {
    "batch": batch,
    "commands": commands,
    "faces": faces,
    "live": live,
    "service": service,
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("old", type=Path, metavar="OLD")
    parser.add_argument("tree", type=Path, metavar="TREE")
    asked = parser.parse_args()
    PARTS[asked.part](asked.old, Tree(asked.old, asked.tree))


if __name__ == "__main__":
    main()
