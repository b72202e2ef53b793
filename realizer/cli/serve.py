"""`serve`: runs the service."""

import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import warn_no_voice
from realizer.core.settings import Settings, SettingsError

LIMITS = tuple(f.name for f in fields(Settings) if f.name.startswith("max_"))


def setting_option(name: str, metavar: str, **attributes: Any) -> options.Decorator:
    """Return the option for a setting, with its description and default; `Settings` checks the value."""
    field = next(f for f in fields(Settings) if f.name == name)
    description, _, unset = field.metadata["description"].partition("; none: ")
    default = unset if field.default in (None, ()) else str(field.default).removesuffix(".0")
    default_note = f"  [default: {default}]" if default else ""
    text = f"{description[0].upper()}{description[1:]}.{default_note}"
    return click.option(f"--{name.replace('_', '-')}", name, metavar=metavar, help=text, **attributes)


def setting_options(*rows: tuple[str, str]) -> options.Decorator:
    """Return a decorator that adds the options for several settings: (name, metavar) of each."""
    return options.several(*(setting_option(name, metavar) for name, metavar in rows))


def _served_face(value: str | None) -> str | None:
    """Return the name of a face; one that is given as a path can be found by its name from now on."""
    from realizer.face.load import VARIABLE, folder_of, is_path

    options.check_face(value)
    if value is None or not is_path(value):
        return value
    folder = folder_of(value)
    os.environ[VARIABLE] = str(folder.parent)  # processes of this service inherit it
    return folder.name


@click.command()
@setting_options(
    ("host", "ADDRESS"),
    ("port", "PORT"),
    ("workers", "N"),
    ("token", "WORD"),
    ("jwt_key", "FILE|SECRET"),
    ("jwt_audience", "WORD"),
    ("hosts", "NAME,..."),
    ("forwarded_allow_ips", "ADDRESS,..."),
    ("allow", "ADDRESS,..."),
)
@option(
    "--insecure",
    "Listen beyond this machine without a token, or without --allow.",
    default=None,
    is_flag=True,
)
@option(
    "--origin ADDRESS",
    "Allow pages of this origin, such as https://example.org, to connect; may be repeated.",
    name="origins",
    multiple=True,
    callback=lambda context, parameter, value: value or None,
)
@setting_options(("tls_cert", "FILE"), ("tls_key", "FILE"), ("log", "text|json"))
@setting_option("asap_ports", "BML FEEDBACK", nargs=2)
@setting_options(
    ("xface_port", "PORT"),
    ("xface_player", "HOST:PORT"),
    ("stomp", "HOST:PORT"),
    ("journal", "FILE|URL"),
    ("vmc", "HOST:PORT"),
    ("livelink", "HOST:PORT"),
    ("avatar_session", "NAME"),
    ("avatar_fps", "N"),
)
@setting_option("record", "DIR", type=click.Path(file_okay=False, path_type=Path))
@setting_option("face", "NAME|PATH", callback=lambda context, parameter, value: _served_face(value))
@options.deformer
@setting_option("camera", "NAME")
@options.light
@options.opaque_background
@setting_options(("voice", "NAME"), ("fps", "N"))
@options.scene
@options.media
@options.expressions
@setting_option("edit", "DIR", type=click.Path(path_type=Path))
@setting_option("corpus", "DIR", type=click.Path(path_type=Path))
@setting_option("seed", "N")
@option("--idle/--no-idle", "Blinks and small head motion of an idle face.", default=None)
@options.motion_options
@options.strict_bml
@setting_options(("grace", "N"), ("keep", "N"), ("drain", "N"), *((name, "N") for name in LIMITS))
@option("--config", "TOML file of settings: fps = 30 means --fps 30.", options.FILE)
def serve(config: Path | None, **flags: Any) -> None:
    """Run the service: play BML from clients, and stream frames, sound and feedback back.

    \b
    realizer serve
    realizer serve --host 0.0.0.0 --token secret --workers 4
    REALIZER_MAX_SESSIONS=100 realizer serve --config service.toml

    Prints the address of each transport when it is ready; the page is at http://HOST:PORT/. On SIGINT or
    SIGTERM the service takes no more work, lets blocks play for up to 5 s, and exits.
    """
    from realizer.server.serve import run
    from realizer.server.serve import serve as run_service
    from realizer.speech.registry import find_voice

    with inputs.reporting(SettingsError):
        settings = Settings.read(flags, file=config)
    options.check_camera(settings.face, settings.camera)
    options.check_light(settings.light)
    find_voice(settings.voice).close()  # fails before a transport opens if the voice is not installed
    warn_no_voice(settings.voice)
    run(run_service(settings))
