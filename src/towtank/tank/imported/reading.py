"""Mapping files: TOML to ``Spec``, every fault with its place and remedy."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from towtank.craft.craft import Craft
from towtank.craft.library import library_names, read_craft
from towtank.errors import InputError
from towtank.symbols import LOADS
from towtank.tank.imported.clauses import (
    axes_of,
    body_of,
    columns_of,
    fins_of,
    mesh_of,
    moment_of,
    motion_of,
    scale_of,
    window_of,
)  # fmt: skip
from towtank.tank.imported.fields import flag, known, one_of, positive, words_of
from towtank.tank.imported.mapping import FORMATS, FRAMES, INCLUDES, LEVELS, MEASURED, SCHEMA, Spec

_RUN_KEYS = (
    "name", "file", "files", "format", "level", "speed", "density", "columns", "axes", "frame", "moment_point",
    "measured", "includes", "body", "half_model", "absent", "scale", "motion", "fins", "window", "mesh", "sum",
    "exploratory",
)  # fmt: skip
_TABLES = ("columns", "moment_point", "scale", "motion", "window", "fins", "mesh")


def read_mapping(path: Path, files: Sequence[Path] = ()) -> tuple[Craft, str, tuple[Spec, ...]]:
    """Read a mapping: the craft, where it is read from, and one ``Spec`` for each run.

    Parameters
    ----------
    path : TOML file of schema towtank/import/1. Keys at its head hold for every [[run]]; a run's own come first.
    files : data files in place of those that the mapping names: all of them for the one run of a mapping, or one for
        each run. Names in the mapping are relative to its folder.

    Raises
    ------
    InputError
        Missing, not TOML, another schema, an unknown or missing key, a wrong number.
    """
    document = _document(path)
    where = path.name
    if document.get("schema") != SCHEMA:
        raise InputError(
            f"{where}: schema {document.get('schema')!r}, wanted {SCHEMA!r}. `towtank import --template csv` shows one."
        )
    known(document, ("schema", "craft", "run", *_RUN_KEYS), where)
    source = document.get("craft")
    if not isinstance(source, str) or not source:
        raise InputError(f'{where}: no craft. Length, origin and fins come from it; write craft = "hokie" or a path.')
    beside = path.parent / source
    source = str(beside) if source not in library_names() and beside.exists() else source
    craft = read_craft(source)
    runs = document.get("run", [{}])
    if not isinstance(runs, list) or not all(isinstance(run, dict) for run in runs) or not runs:
        raise InputError(f"{where}: runs are not a list of tables. Head each with [[run]].")
    if files and len(runs) > 1 and len(files) != len(runs):
        raise InputError(
            f"{where}: {len(files)} files for {len(runs)} runs. Give one file for each run, in their order, or name "
            "them in the mapping with file = ."
        )
    head = {key: value for key, value in document.items() if key in _RUN_KEYS}
    specs = []
    for number, own in enumerate(runs, start=1):
        place = f"{where}: run {number}" + (f" ({own['name']})" if isinstance(own.get("name"), str) else "")
        given = files if len(runs) == 1 else files[number - 1 : number]
        specs.append(_spec(_merged(head, own, place), craft, path.parent, tuple(given), place))
    _distinct([spec.name for spec in specs], where)
    return craft, source, tuple(specs)


def _document(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"{path} does not exist. `towtank import --template star > {path.name}` writes one to edit."
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path} is not a readable TOML file ({error}). Texts and quantities with units need quotes, as in "
            'speed = "1 m/s".'
        ) from None


def _merged(head: Mapping[str, Any], own: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Keys of the head with those of a run over them; tables are merged key by key, but for the motion."""
    known(own, _RUN_KEYS, where)
    out = dict(head)
    for key, value in own.items():
        both = key in _TABLES and key != "motion" and isinstance(value, dict) and isinstance(head.get(key), dict)
        out[key] = {**head[key], **value} if both else value
    if "file" in own:
        out.pop("files", None)
    return out


def _spec(run: Mapping[str, Any], craft: Craft, folder: Path, files: tuple[Path, ...], where: str) -> Spec:
    name = run.get("name")
    if not isinstance(name, str) or not name:
        raise InputError(f'{where}: no name. Give each run its own, for example name = "sway-slow".')
    form = one_of(run, "format", FORMATS, where)
    speed = positive(run, "speed", "m/s", where)
    columns = columns_of(run.get("columns", {}), form, where)
    motion = motion_of(run, columns, where)
    scale = scale_of(run.get("scale"), speed, where)
    includes = words_of(run.get("includes", []), INCLUDES, f"{where}, includes")
    measured = one_of(run, "measured", MEASURED, where, "water on craft")
    if "inertia" in includes and measured == "water on craft":
        raise InputError(
            f'{where}: the water does not feel the inertia of the craft. Loads that include it are measured "craft on '
            'balance" or "balance on craft".'
        )
    half = one_of(run, "half_model", ("", "xz", "xy"), where, "")
    return Spec(
        name=name,
        files=files or _files(run, folder, where),
        format=form,
        level=one_of(run, "level", LEVELS, where),
        speed=speed,
        density=positive(run, "density", "kg/m^3", where),
        motion=motion,
        moment=moment_of(run, form, where),
        columns=columns,
        axes=axes_of(run.get("axes"), where),
        frame=one_of(run, "frame", FRAMES, where, "body"),
        measured=measured,
        includes=includes,
        body=body_of(run, craft, scale, where) if includes else None,
        half_model=half,
        absent=words_of(run.get("absent", []), LOADS, f"{where}, absent"),
        scale=scale,
        fins=fins_of(run.get("fins", {}), craft, where),
        window=window_of(run.get("window", {}), where),
        mesh=mesh_of(run.get("mesh", {}), where),
        sum=flag(run.get("sum", False), f"{where}, sum"),
        exploratory=flag(run.get("exploratory", False), f"{where}, exploratory"),
    )


def _files(run: Mapping[str, Any], folder: Path, where: str) -> tuple[Path, ...]:
    if "file" in run and "files" in run:
        raise InputError(f"{where}: both file and files. Write one of them.")
    given = run.get("files", [run["file"]] if "file" in run else [])
    if not isinstance(given, list) or not given or not all(isinstance(item, str) and item for item in given):
        raise InputError(f'{where}: no file. Write file = "sway.csv" or files = [...], or name files on the command.')
    return tuple(folder / item for item in given)


def _distinct(names: Sequence[str], where: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(
            f"{where}: {len(twice)} names are used twice ({', '.join(twice)}). Give each run its own name."
        )
