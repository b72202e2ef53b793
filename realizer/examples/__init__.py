"""The example documents that ship with the package, in the order they are played."""

from importlib.resources import files


def examples() -> dict[str, str]:
    """Name -> BML text, in order: "greeting", "nod-on-a-word", ..."""
    found = sorted((f for f in files(__name__).iterdir() if f.name.endswith(".bml")), key=lambda f: f.name)
    return {f.name.removesuffix(".bml").partition("-")[2]: f.read_text("utf-8") for f in found}
