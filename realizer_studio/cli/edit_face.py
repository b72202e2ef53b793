"""`faces edit`: opens the page's Face tab on a copy of a face."""

import os
import shutil
from pathlib import Path

import click

from realizer.cli.options import completing_faces, option
from realizer.core.settings import Settings


@click.command("edit")
@click.argument("name", shell_complete=completing_faces)
@option(
    "--edit",
    "Folder to save in; the copy of the face is in its folder faces.",
    click.Path(file_okay=False, path_type=Path),
    default=Path("edited"),
    name="folder",
)
@option("--port", "Port of the page.  [default: a free one]", default=0, show_default=False)
@option("--browser/--no-browser", "Open the page in the browser.", default=True, show_default=False)
def edit_face(name: str, folder: Path, port: int, browser: bool) -> None:
    """Edit the feature points and zones of a face in the browser, on a copy of it.

    Serves the page on this machine until Ctrl-C and prints its address. A copy that is there already is
    edited further.

    \b
    realizer faces edit ada
    realizer realize hello.bml -o hello.mp4 --face edited/faces/ada
    """
    import asyncio

    from realizer.face.load import VARIABLE, folder_of

    source = folder_of(name)
    copy = (folder / "faces" / source.name).resolve()
    if not copy.exists():
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, copy)
    os.environ[VARIABLE] = str(copy.parent)
    settings = Settings.read({"host": "127.0.0.1", "port": port, "face": copy.name, "edit": folder})
    click.echo(f"{copy}: the copy that is edited")
    asyncio.run(serve_tab(settings, "face", browser))


async def serve_tab(settings: Settings, tab: str, browser: bool) -> None:
    """Serve the page, and show a tab of it, until the command is stopped."""
    import signal
    import webbrowser

    from realizer.server.serve import Server, wait_for_signal

    ending = wait_for_signal(signal.SIGINT, signal.SIGTERM)

    async with Server(settings) as server:
        address = f"{server.page}#{tab}"
        click.echo(f"page: {address}")
        if browser:
            webbrowser.open(address)
        await ending
