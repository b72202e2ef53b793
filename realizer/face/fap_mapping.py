"""The mapping of AUs to FAPs that applies to a face, with a user's file on top."""

from functools import lru_cache
from pathlib import Path

from realizer.animation.fap.conversion import FapMapping, standard
from realizer.face.reading import face_errors
from realizer.tables.mappings import own_file, read_mapping


def mapping_of(face: str = "default", file: Path | None = None) -> FapMapping:
    """Return the mapping of action units to FAPs: rows of the file, then of the face, then of the table.

    Args:
        face: name of a face folder; its `au_to_fap.csv` or `au_to_fap.txt` holds its own rows.
        file: a user's own mapping, in either form.

    Raises:
        FaceError: no such face, or its own file cannot be used; with the line.
        TableError: the user's file cannot be used; with the line.
    """
    from realizer.face.load import folder_of

    return _mapping(folder_of(face), file)


@lru_cache(maxsize=16)
def _mapping(folder: Path, file: Path | None) -> FapMapping:
    mapping = standard()
    with face_errors(folder, "one mapping of action units to FAPs"):
        if own := own_file(folder):
            mapping = mapping.replaced(read_mapping(own), str(own))
    return mapping.replaced(read_mapping(file), str(file)) if file else mapping
