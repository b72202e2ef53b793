"""`doctor`: reports what this machine has, and what to install for the rest."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from importlib.util import find_spec

import click

Finding = tuple[bool, str, str]  # there, what, the fix or a detail


@click.command()
def doctor() -> int:
    """Say what is there and what is missing, a line each with the fix."""
    missing = 0
    for look in (_pictures, _voices, _film, _node, _faces, _page):
        for there, what, words in look():
            missing += not there
            mark = click.style("ok     ", fg="green") if there else click.style("missing", fg="yellow")
            click.echo(f"{mark}  {what:<10} {words}")
    return 0


def _pictures() -> Iterator[Finding]:
    from realizer.render.drawing_process import available_backend

    says = {"gl": "drawn by OpenGL", "onboard": "drawn by the processor, without OpenGL"}
    way, fix = available_backend()
    yield fix is None, "pictures", fix or says[way]


def _voices() -> Iterator[Finding]:
    from realizer.speech.registry import voices

    for voice in voices():
        yield voice.available, voice.name, voice.description


def _film() -> Iterator[Finding]:
    there = find_spec("av") is not None
    yield there, "FFmpeg", "PyAV writes films" if there else "pip install 'bml-realizer[film]'"


def _node() -> Iterator[Finding]:
    there = shutil.which("npm") is not None
    says = "npm is used to build the page from source"
    yield there, "node", says if there else "not needed to run; the build takes node from a wheel"


def _faces() -> Iterator[Finding]:
    from realizer.face.load import list_faces
    from realizer.facebuild.check import check_face

    found = list_faces()
    if not found:
        yield False, "faces", "no face folder was found; reinstall bml-realizer"
    for face in found:
        faults = check_face(face.name)
        yield not faults, "face", f"{face.name}: {faults[0] if faults else face.description}"


def _page() -> Iterator[Finding]:
    from importlib.resources import files

    there = files("realizer.server").joinpath("static", "index.html").is_file()
    fix = "the page is not built; install from a wheel, or have npm and run pip install -e ."
    yield there, "page", "served at http://HOST:PORT/" if there else fix
