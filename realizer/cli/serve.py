"""`serve`: runs the service."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import click

from realizer.cli import options
from realizer.core.settings import Settings

# What a service takes is told as its settings tell it.
LIMITS = [f for f in fields(Settings) if f.name.startswith("max_") or f.name in ("keep", "drain")]


def limits(command: Callable[..., None]) -> Callable[..., None]:
    """A flag for each limit; the settings read its value, as they read a variable's."""
    for one in reversed(LIMITS):
        default = "none" if one.default is None else str(one.default).removesuffix(".0")
        says = one.metadata["says"].partition("; none:")[0]
        flag = f"--{one.name.replace('_', '-')}"
        command = click.option(flag, metavar="N", help=f"{says[0].upper()}{says[1:]}.  [default: {default}]")(
            command
        )
    return command


@click.command()
@click.option("--host", metavar="ADDRESS", help="Address to listen on.  [default: 127.0.0.1]")
@click.option("--port", type=int, help="Port of WebSocket and page; 0 takes a free one.  [default: 8765]")
@click.option(
    "--workers", type=int, help="Processes that serve the port, each its own sessions.  [default: 1]"
)
@click.option(
    "--token",
    metavar="WORD",
    help="What clients of the WebSocket must bring; REALIZER_TOKEN is not seen by who lists processes.",
)
@click.option(
    "--jwt-key",
    metavar="FILE|SECRET",
    help="Beside or instead of --token: a public key in PEM, or a secret (better in REALIZER_JWT_KEY), by "
    "which JWTs of clients are signed.",
)
@click.option("--jwt-audience", metavar="WORD", help="What these must be for, their claim aud.")
@click.option(
    "--origin",
    "origins",
    multiple=True,
    metavar="ADDRESS",
    callback=lambda context, parameter, value: value or None,
    help="A page elsewhere that may open a WebSocket, as https://example.org; may be given several times.",
)
@click.option(
    "--tls-cert",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Certificates in PEM: the service speaks TLS.",
)
@click.option(
    "--tls-key", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="Its key in PEM."
)
@click.option("--log", type=click.Choice(["text", "json"]), help="How logs are written.  [default: text]")
@click.option(
    "--asap-ports",
    nargs=2,
    type=int,
    metavar="BML FEEDBACK",
    help="Serve clients of Asap's TCP: BML on our first port, feedback to their second one, as in 7500 7501.",
)
@click.option(
    "--xface-port",
    type=int,
    metavar="PORT",
    help="Serve clients of an Xface player, whose port is 50011: FAP files, playback, scripts of BML.",
)
@click.option(
    "--xface-player",
    metavar="HOST:PORT",
    help="Show the session xface-player on this Xface player, four frames a second.",
)
@click.option("--stomp", metavar="HOST:PORT", help="Serve clients of this STOMP broker: ASAP JSON, VHMSG.")
@click.option(
    "--journal",
    metavar="FILE|URL",
    help="Keep sessions that have a name, so that a service that died, or another one, goes on with them.",
)
@click.option(
    "--record",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Record every session, for `realizer replay`.",
)
@click.option("--face", metavar="NAME", help="Face of characters that name none.  [default: default]")
@options.deformer
@click.option("--camera", metavar="NAME", help=f"Of pictures that name none: {options.CAMERAS}")
@options.light
@options.colour
@click.option("--voice", metavar="NAME", help="Voice of characters that name none.")
@click.option("--fps", type=float, help="Frames a second of streams that name no rate.  [default: 25]")
@click.option(
    "--scene", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="Targets of every session."
)
@options.media
@options.expressions
@click.option("--seed", type=int, help="Of idle motion.  [default: 0]")
@click.option("--idle/--no-idle", default=None, help="Blinks and small head motion.  [default: idle]")
@options.prosody
@options.cooccurrence
@options.mapping
@limits
@click.option(
    "--config", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="A TOML file of settings."
)
def serve(config: Path | None, **flags: Any) -> None:
    """Take BML over a WebSocket; stream frames, sound and feedback back.

    Prints one line for each open door when it is ready. SIGINT or SIGTERM: takes no more work, gives what
    plays 5 s, ends.
    """
    from realizer.core.settings import SettingsError
    from realizer.server.serve import run
    from realizer.server.serve import serve as start
    from realizer.speech.registry import find_voice

    try:
        settings = Settings.read(flags, file=config)
    except SettingsError as error:
        raise click.UsageError(str(error)) from None
    options.check_camera(settings.face, settings.camera)
    options.check_light(settings.light)
    find_voice(settings.voice).close()  # a voice that is not installed is said before a door opens
    options.warn_no_voice(settings.voice)
    run(start(settings))
