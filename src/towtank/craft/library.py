"""Reading crafts: from the library by name, or from a file by path."""

from __future__ import annotations

import difflib
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from towtank.artefact import write_text
from towtank.craft.craft import Craft
from towtank.errors import CraftError

CRAFT_FILE = "craft.toml"
"""Name of the craft file in a study folder."""


def library_names() -> tuple[str, ...]:
    """Names of the crafts that come with the package, sorted."""
    return tuple(sorted(_shelf()))


def _shelf() -> dict[str, Traversable]:
    folder = files("towtank.craft") / "library"
    return {item.name.removesuffix(".toml"): item for item in folder.iterdir() if item.name.endswith(".toml")}


def craft_text(source: str | Path) -> str:
    """Text of the craft file ``source``: a name of the library, a path, or a study folder.

    A path that exists goes before a name of the library, unless it is a folder without a craft file.

    Raises
    ------
    CraftError
        No such file or name, or the file cannot be read.
    """
    path = Path(source)
    if path.is_dir():
        path = path / CRAFT_FILE
    shelf = _shelf()
    if not path.is_file() and str(source) in shelf:
        return shelf[str(source)].read_text(encoding="utf-8")
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        near = difflib.get_close_matches(str(source), shelf, n=1, cutoff=0.5)
        hint = f"Did you mean {near[0]}? " if near else ""
        raise CraftError(
            f"no craft {str(source)!r}: it is neither a file nor a craft of the library ({', '.join(library_names())})."
            f" {hint}`towtank new NAME` writes a template."
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise CraftError(f"cannot read {path}: {error}. A craft file is UTF-8 text in TOML.") from None


def read_craft(source: str | Path) -> Craft:
    """Read a craft: a name of the library (``library_names``), the path of a TOML file, or a study folder.

    Raises
    ------
    CraftError
        No such craft, not TOML, or faults in it; all faults are told at once, with their dotted paths.
    """
    from towtank.craft.build import build
    from towtank.craft.reading import read_toml

    where = f"craft {str(source)!r}"
    return build(read_toml(craft_text(source), where), where)


def write_craft_copy(source: str | Path, folder: str | Path) -> Path:
    """Store the craft file ``source`` verbatim as ``craft.toml`` in ``folder``; returns its path.

    Raises
    ------
    CraftError
        The source cannot be read.
    ArtefactError
        The folder cannot be written.
    """
    return write_text(Path(folder) / CRAFT_FILE, craft_text(source))
