"""`serve`: runs the service."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import click

from realizer.cli import options
from realizer.core.settings import Settings

LIMITS = [f for f in fields(Settings) if f.name.startswith("max_") or f.name in ("keep", "drain")]


def limits(command: Callable[..., None]) -> Callable[..., None]:
    """Add an option for each limit of the settings, with their description."""
    for limit in reversed(LIMITS):
        default = "none" if limit.default is None else str(limit.default).removesuffix(".0")
        text = limit.metadata["says"].partition("; none:")[0]
        words = f"{text[0].upper()}{text[1:]}.  [default: {default}]"
        command = click.option(f"--{limit.name.replace('_', '-')}", metavar="N", help=words)(command)
    return command


@click.command()
@click.option("--host", metavar="ADDRESS", help="Address to listen on.  [default: 127.0.0.1]")
@click.option(
    "--port", type=int, help="Port of the WebSocket and the page; 0: any free one.  [default: 8765]"
)
@click.option("--workers", type=int, help="Number of processes that share the port.  [default: 1]")
@click.option(
    "--token",
    metavar="WORD",
    help="Password for WebSocket clients; the variable REALIZER_TOKEN hides it from other users.",
)
@click.option(
    "--jwt-key",
    metavar="FILE|SECRET",
    help="Accept clients with a JWT signed by this key: a PEM file of a public key, or a secret (better in "
    "REALIZER_JWT_KEY).",
)
@click.option("--jwt-audience", metavar="WORD", help="Required claim aud of these JWTs.")
@click.option(
    "--origin",
    "origins",
    multiple=True,
    metavar="ADDRESS",
    callback=lambda context, parameter, value: value or None,
    help="Allow pages of this origin, such as https://example.org, to connect; may be repeated.",
)
@click.option(
    "--tls-cert",
    type=options.FILE,
    help="Use TLS with this certificate chain (PEM).",
)
@click.option("--tls-key", type=options.FILE, help="Private key of the certificate (PEM).")
@click.option("--log", type=click.Choice(["text", "json"]), help="Format of log messages.  [default: text]")
@click.option(
    "--asap-ports",
    nargs=2,
    type=int,
    metavar="BML FEEDBACK",
    help="Serve clients of ASAP over TCP: take BML on the first port, send feedback to the client's second "
    "port, such as 7500 7501.",
)
@click.option(
    "--xface-port",
    type=int,
    metavar="PORT",
    help="Serve clients of an Xface player (port 50011 there): FAP files, playback, BML scripts.",
)
@click.option(
    "--xface-player",
    metavar="HOST:PORT",
    help="Show the session xface-player on this Xface player, at four frames per second.",
)
@click.option(
    "--stomp", metavar="HOST:PORT", help="Serve clients of this STOMP broker: BML in XML or JSON, and VHMSG."
)
@click.option(
    "--journal",
    metavar="FILE|URL",
    help="Save named sessions to a file or redis://HOST:PORT/N, so that a restarted service continues them.",
)
@click.option(
    "--record",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Record every session for `realizer replay`.",
)
@click.option("--face", metavar="NAME", help="Default face of characters.  [default: default]")
@options.deformer
@click.option("--camera", metavar="NAME", help=f"Default camera: {options.CAMERAS}")
@options.light
@options.opaque_background
@click.option("--voice", metavar="NAME", help="Default voice of characters; see `realizer voices`.")
@click.option("--fps", type=float, help="Default frames per second of streams.  [default: 25]")
@options.scene
@options.media
@options.expressions
@click.option("--seed", type=int, help="Seed of idle motion.  [default: 0]")
@click.option(
    "--idle/--no-idle", default=None, help="Blinks and small head motion of an idle face.  [default: --idle]"
)
@options.prosody
@options.cooccurrence
@options.mapping
@limits
@click.option("--config", type=options.FILE, help="TOML file of settings: fps = 30 means --fps 30.")
def serve(config: Path | None, **flags: Any) -> None:
    """Run the service: play BML from clients and stream frames, sound and feedback to them.

    \b
    realizer serve
    realizer serve --port 80 --host 0.0.0.0 --token secret --workers 4
    REALIZER_MAX_SESSIONS=100 realizer serve --config service.toml

    Prints the address of each transport when it is ready; the page is at http://HOST:PORT/. On SIGINT or
    SIGTERM the service takes no more work, lets blocks play for up to 5 s, and exits.
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
    find_voice(settings.voice).close()  # fails before a transport opens if the voice is not installed
    options.warn_no_voice(settings.voice)
    run(start(settings))
