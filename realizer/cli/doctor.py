"""`doctor`, `voices`, `outputs` and `plugins`: list what works on this machine, and how to get the rest."""

import json
import platform
import shutil
from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from importlib.util import find_spec

import click

import realizer
from realizer.cli import options
from realizer.cli.progress import note
from realizer.core.errors import FaceError

Finding = tuple[bool, str, str]  # whether it works, its name, a description or the fix
PACKAGES = ("numpy", "scipy", "numba", "moderngl", "av", "espeakng-loader", "hibari-tts", "pocketsphinx")
MODULES = {"film": "av"}  # extra -> a module that it installs


@click.command()
@options.as_json
def doctor(as_json: bool) -> None:
    """Check the installation: pictures, voices, films, faces and the page, and print versions.

    Prints one line per part: ok, or missing and how to fix it.
    """
    versions = _versions()
    if as_json:
        found = [{"part": n, "works": works, "text": text} for works, n, text in _parts()]
        click.echo(json.dumps({"versions": versions, "parts": found}, indent=1))
        return
    words = ", ".join(f"{name} {version or 'missing'}" for name, version in versions.items())
    click.echo(f"{click.style('ok     ', fg='green')}  {'versions':<10} {words}")
    for works, name, text in _parts():
        mark = click.style("ok     ", fg="green") if works else click.style("missing", fg="yellow")
        click.echo(f"{mark}  {name:<10} {text}")


def _versions() -> dict[str, str | None]:
    """Return the versions of Python, of this program, and of what affects its outputs; None if missing."""
    found: dict[str, str | None] = {"Python": platform.python_version(), "bml-realizer": realizer.__version__}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    return found


def _parts() -> Iterator[Finding]:
    """Yield what works, or how to fix it, as soon as it is known."""
    from realizer.face.load import list_faces, load_face
    from realizer.render.drawing_process import available_backend
    from realizer.speech.recorded.recorded_speech import ALIGNERS
    from realizer.speech.registry import voices

    descriptions = {"gl": "drawn by OpenGL", "onboard": "drawn by the processor, without OpenGL"}
    backend, fix = available_backend()
    yield fix is None, "pictures", fix or descriptions[backend]
    for voice in voices():
        yield voice.available, voice.name, voice.description
    for _, aligner in ALIGNERS.working():
        yield (fix := aligner.missing()) is None, "align", fix or aligner.description
    fix = _fix("film")
    yield fix is None, "FFmpeg", fix or "PyAV writes films"
    works = shutil.which("npm") is not None
    text = "npm is used to build the page from source"
    yield works, "node", text if works else "not needed to run; the build takes node from a wheel"
    faces = list_faces()
    if not faces:
        yield False, "faces", "no face folder was found; reinstall bml-realizer"
    for face in faces:
        try:
            load_face(face.name)
            yield True, "face", f"{face.name}: {face.description}"
        except FaceError as error:
            yield False, "face", f"{face.name}: {error}"
    works = files("realizer.server").joinpath("static", "index.html").is_file()
    fix = "the page is not built; install from a wheel, or have npm and run pip install -e ."
    yield works, "page", "served at http://HOST:PORT/" if works else fix


@click.command()
def voices() -> None:
    """List the voices that --voice takes, and how to install missing ones."""
    from realizer.speech.registry import voices as all_voices

    for voice in all_voices():
        click.echo(f"{voice.name:<16} {voice.description}")


@click.command()
def outputs() -> None:
    """List the file formats that `realize -o` writes.

    Prints suffix, media type and contents, and what to install where something is missing.
    """
    from realizer.outputs.registry import OUTPUTS

    working = sorted(OUTPUTS.working())
    width = max(len(suffix) for suffix, _ in working)
    type_width = max(len(output.media_type) for _, output in working)
    for suffix, output in working:
        fixes = "; ".join(filter(None, map(_fix, output.needs)))
        missing = f"  (missing: {fixes})" if fixes else ""
        click.echo(f"{suffix:<{width}}  {output.media_type:<{type_width}}  {output.description}{missing}")


@click.command()
@options.as_json
def plugins(as_json: bool) -> None:
    """List what other packages add: behaviours, outputs, voices, transports, faces, commands, editors.

    Prints group, name, package and object of each, and why it cannot be used if so.
    """
    from realizer.behaviours.registry import FAMILIES
    from realizer.cli.command_group import COMMANDS
    from realizer.face.load import BUILDERS, FACES
    from realizer.outputs.registry import OUTPUTS
    from realizer.server.editors import EDITORS
    from realizer.server.session.tracked_faces import TRACKERS
    from realizer.server.transports.transport import TRANSPORTS
    from realizer.speech.recorded.recorded_speech import ALIGNERS
    from realizer.speech.registry import VOICES

    groups = (FAMILIES, OUTPUTS, VOICES, TRANSPORTS, FACES, BUILDERS, COMMANDS, EDITORS, TRACKERS, ALIGNERS)
    found = [plugin for registry in groups for plugin in registry.plugins()]
    if as_json:
        click.echo(json.dumps([asdict(plugin) for plugin in found], indent=1))
        return
    for plugin in found:
        fault = f"  (not used: {plugin.fault})" if plugin.fault else ""
        click.echo(f"{plugin.group:<20} {plugin.name:<12} {plugin.package:<16} {plugin.value}{fault}")
    if not found:
        note("no plug-ins are installed; docs/adding.md says how to write one")


@cache
def _fix(extra: str) -> str | None:
    if extra == "render":
        from realizer.render.drawing_process import unavailable_reason

        return unavailable_reason()
    return None if find_spec(MODULES[extra]) else f"pip install 'bml-realizer[{extra}]'"
