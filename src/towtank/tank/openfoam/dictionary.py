"""Text of OpenFOAM's dictionaries: entries changed in place, fields taken over from another case."""

from __future__ import annotations

import re
from pathlib import Path

from towtank.artefact import replace_file, write_text
from towtank.errors import TankError


def set_entry(path: Path, key: str, value: str) -> None:
    """Change the entry ``key value;`` of a dictionary, its first one, and leave all else as it stands.

    Raises
    ------
    TankError
        There is no such entry.
    """
    text = path.read_text(encoding="utf-8")
    changed, count = re.subn(rf"(?m)(\b{re.escape(key)}\s+)[^;{{}}]+;", rf"\g<1>{value};", text, count=1)
    if not count:
        raise TankError(f"{path} has no entry {key!r}, which is set there. Write the case again in a fresh folder.")
    write_text(path, changed)


def entry(path: Path, key: str) -> str:
    """Value of the first entry ``key value;`` of a dictionary."""
    found = re.search(rf"\b{re.escape(key)}\s+([^;{{}}]+);", path.read_text(encoding="utf-8"))
    if found is None:
        raise TankError(f"{path} has no entry {key!r}. Write the case again in a fresh folder.")
    return found[1].strip()


_INTERNAL, _BOUNDARY = b"internalField", b"boundaryField"


def take_over_field(target: Path, source: Path, cells: int) -> None:
    """Give the field ``target`` the cell values of ``source``, which lives on the same mesh; the boundary stays.

    Raises
    ------
    TankError
        The source is damaged, or holds another number of cells.
    """
    ours, theirs = target.read_bytes(), source.read_bytes()
    values = _span(theirs, source)
    block = theirs[values]
    listed = re.match(rb"internalField\s+nonuniform\s+List<\w+>\s*\n?(\d+)", block)
    if listed is None and b"uniform" not in block[:80]:
        raise TankError(f"{source}: its values cannot be found. The file is damaged; start from another case.")
    if listed is not None and int(listed[1]) != cells:
        raise TankError(f"{source} has {int(listed[1])} cells and the new mesh {cells}. Start from a case on its mesh.")
    if re.search(rb"format\s+binary", theirs[:2000]):
        ours = re.sub(rb"format\s+ascii", b"format binary", ours, count=1)
        arch = re.search(rb'arch\s+"[^"]*";', theirs[:2000])
        if arch and b"arch" not in ours[:400]:
            ours = ours.replace(b"format binary;", b"format binary; " + arch[0], 1)
    place = _span(ours, target)
    replace_file(target, lambda part: _put(part, ours[: place.start] + block + ours[place.stop :]))


def _span(content: bytes, path: Path) -> slice:
    start, stop = content.find(_INTERNAL), content.rfind(_BOUNDARY)
    if start < 0 or stop < start:
        raise TankError(f"{path} is not a whole field: internalField and boundaryField are wanted. Delete its time.")
    return slice(start, stop)


def _put(part: Path, content: bytes) -> None:
    part.write_bytes(content)


def times(folder: Path) -> list[Path]:
    """Time folders of a case or of one of its processors, oldest first, without that of the start."""
    found = [(float(path.name), path) for path in folder.iterdir() if path.is_dir() and _is_time(path.name)]
    return [path for value, path in sorted(found) if value > 0.0]


def _is_time(name: str) -> bool:
    try:
        float(name)
    except ValueError:
        return False
    return name[0].isdigit()
