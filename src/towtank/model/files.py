"""model.json: a model that needs no other file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import read_json, write_json
from towtank.craft.craft import Craft, Fin, Mass, Profile, Propeller, Strake
from towtank.craft.hull import Ellipsoid, Myring, Offsets, Suboff
from towtank.derive.files import document as derivatives_document
from towtank.derive.files import from_document as derivatives_of
from towtank.errors import ArtefactError, InputError
from towtank.model.equations import Model
from towtank.model.faults import faults_document, faults_of
from towtank.model.options import ModelOptions
from towtank.provenance import digest, provenance
from towtank.water import Water

SCHEMA = "towtank/model/1"

_PROFILES: Mapping[str, type[Any]] = {"myring": Myring, "suboff": Suboff, "ellipsoid": Ellipsoid, "offsets": Offsets}

_STATIONS = 201
"""Stations of the table of offsets that stands for a profile of another family."""


def write_model(model: Model, path: str | Path) -> Path:
    """Write ``model`` with its craft and derivatives as JSON, schema ``towtank/model/1``; SI units, radians.

    Raises
    ------
    InputError
        The model has an extra load, which is a Python function.
    ArtefactError
        The folder cannot be written.
    """
    if model.extra is not None:
        raise InputError(
            f"{path}: the model has the extra load {model.extra.name!r}. A model file holds numbers only: a Python "
            "function cannot be stored in it. Keep the function in a script, write model.with_extra(None), and add the "
            "load again with with_extra after reading."
        )
    craft, derivatives = model.craft, model.derivatives
    document = {
        "schema": SCHEMA,
        "craft": _craft_document(craft),
        "options": {
            **asdict(model.options),
            "faults": faults_document(model.options.faults),
            "centre_of_buoyancy": [model.body.xB, model.body.yB, model.body.zB],
        },
        "mass_matrix": model.mass_matrix,
        "derivatives": derivatives_document(derivatives),
        "provenance": provenance({"craft": digest(craft), "derivatives": digest(derivatives.as_dict())}),
    }
    return write_json(Path(path), document)


def read_model(path: str | Path) -> Model:
    """Read a model written by ``write_model``.

    Raises
    ------
    ArtefactError
        Missing, not JSON, another schema, or an entry that is missing or of another kind.
    """
    path = Path(path)
    document = read_json(path, SCHEMA)
    try:
        options = document["options"]
        return Model(
            _craft(document["craft"]),
            derivatives_of(document["derivatives"]),
            ModelOptions(
                **{
                    **options,
                    "centre_of_buoyancy": tuple(options["centre_of_buoyancy"]),
                    "faults": faults_of(options.get("faults", ())),
                }
            ),
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: an entry is missing or cannot be used ({type(error).__name__}: {error}). Write the file again "
            "with `towtank derive`."
        ) from None


def _craft_document(craft: Craft) -> dict[str, Any]:
    profile = craft.profile
    if _PROFILES.get(profile.kind) is not type(profile):
        x = np.linspace(0.0, profile.length, _STATIONS)
        profile = Offsets(tuple(x.tolist()), tuple(np.asarray(profile.radius(x)).tolist()))
    return {
        "name": craft.name,
        "title": craft.title,
        "speed": craft.speed,
        "origin_from_nose": craft.origin_from_nose,
        "profile": {"kind": profile.kind, **asdict(profile)},  # type: ignore[call-overload]
        "fins": [asdict(fin) for fin in craft.fins],
        "strakes": [asdict(strake) for strake in craft.strakes],
        "mass": asdict(craft.mass),
        "propeller": asdict(craft.propeller),
        "water": asdict(craft.water),
        "assumed": craft.assumed,
        "unsourced": craft.unsourced,
        "sources": craft.sources,
    }


def _craft(document: Mapping[str, Any]) -> Craft:
    plain = {name: _tuples(value) for name, value in document.items()}
    shape = dict(plain["profile"])
    profile: Profile = _PROFILES[shape.pop("kind")](**shape)
    nested = {
        "profile": profile,
        "fins": tuple(Fin(**fin) for fin in plain["fins"]),
        "strakes": tuple(Strake(**strake) for strake in plain.get("strakes", ())),
        "mass": Mass(**plain["mass"]),
        "propeller": Propeller(**plain["propeller"]),
        "water": Water(**plain["water"]),
    }
    return Craft(**{**plain, **nested})


def _tuples(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value
