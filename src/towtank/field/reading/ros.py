"""Logs of ROS: bags of ROS 1 (.bag) and folders of ROS 2 (sqlite3 and mcap), by the library ``rosbags``."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.field.reading.raw import Fault, Group, Raw, table_of

NOTE = "/towtank/note"
"""Topic that holds what towtank says of its own log."""
_STEP = re.compile(r"^(?P<name>\w+)(?:\[(?P<index>[^\]]+)\])?$")
Rows = dict[str, list[tuple[int, list[float]]]]


def read_ros(path: Path, wanted: Mapping[str, Sequence[str]], sparse: bool) -> Raw:
    """A bag: each topic of ``wanted`` is a group with the fields that are asked for.

    A time is the stamp of the message's header, or that of the bag where there is none.

    Parameters
    ----------
    wanted : topic -> fields, such as "pose.pose.position.x", "position[0]", or "position[upper]" of a JointState.
    sparse : topics and fields that the bag does not hold are left out.

    Raises
    ------
    InputError
        ``rosbags`` is not installed, the bag is damaged, or it lacks a topic or a field.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(f'{path}: reading a bag needs rosbags. Install it: pip install "towtank[field]".') from None
    usual = get_typestore(Stores.ROS2_HUMBLE if path.is_dir() else Stores.ROS1_NOETIC)
    try:
        with AnyReader([path], default_typestore=usual) as reader:
            return _read(path, reader, wanted, sparse)
    except InputError:
        raise
    except Exception as error:  # rosbags, sqlite3 and struct raise many kinds on damaged files
        raise InputError(
            f"{path} is not a whole bag ({str(error).rstrip('.') or type(error).__name__}). Reindex it with the tools "
            "of ROS (rosbag reindex, ros2 bag reindex), or give the folder that holds metadata.yaml."
        ) from None


def topics_of(path: Path) -> tuple[str, ...]:
    """Topics of a bag; none where it cannot be opened."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            return tuple(connection.topic for connection in reader.connections)
    except Exception:  # as in read_ros, which tells the reason
        return ()


def _read(path: Path, reader: Any, wanted: Mapping[str, Sequence[str]], sparse: bool) -> Raw:
    held = {connection.topic for connection in reader.connections}
    if (lacking := [topic for topic in wanted if topic not in held]) and not sparse:
        raise InputError(f"{path.name}: no topic {', '.join(lacking)}. The bag has {', '.join(sorted(held))}.")
    taken = [c for c in reader.connections if c.topic in wanted or c.topic == NOTE]
    rows: Rows = {topic: [] for topic in wanted if topic in held}
    absent: dict[str, set[str]] = {topic: set() for topic in rows}
    note: dict[str, Any] = {}
    faults: list[Fault] = []
    count = 0
    try:
        for connection, at, data in reader.messages(connections=taken):
            message = reader.deserialize(data, connection.msgtype)
            count += 1
            if connection.topic == NOTE:
                note = _note(message)
                continue
            fields = wanted[connection.topic]
            values = [_field(message, field, absent[connection.topic]) for field in fields]
            rows[connection.topic].append((_stamp(message, at), values))
    except Exception as error:  # a bag that breaks off in the middle: what came before is whole
        if not count:
            raise
        faults.append(Fault(1, f"the bag breaks off after {count} messages ({str(error).rstrip('.')})"))
    return _raw(path, rows, wanted, absent, sparse, note, faults)


def _raw(
    path: Path, rows: Rows, wanted: Mapping[str, Sequence[str]], absent: Mapping[str, set[str]], sparse: bool,
    note: Mapping[str, Any], faults: list[Fault],
) -> Raw:  # fmt: skip
    stamps = [at for found in rows.values() for at, _ in found]
    if not stamps:
        raise InputError(f"{path.name}: no message on {', '.join(wanted)}. Map topics that the bag holds messages of.")
    second = min(stamps) // 10**9
    groups = {}
    for topic, found in rows.items():
        if not found:
            continue
        gone = [field for field in wanted[topic] if field in absent[topic]]
        if gone and not sparse:
            raise InputError(
                f"{path.name}, {topic}: its messages have no field {', '.join(gone)}. Correct the mapping."
            )
        names = tuple(field for field in wanted[topic] if field not in absent[topic])
        values = np.array([row for _, row in found], dtype=float).reshape(len(found), -1)
        kept = values[:, [wanted[topic].index(name) for name in names]]
        time = np.array([(at - second * 10**9) * 1e-9 for at, _ in found])
        groups[topic] = Group(table_of(f"{path.name} {topic}", names, ("",) * len(names), kept), {}, time)
    return Raw(path.name, groups, float(second), note, tuple(faults))


def _stamp(message: Any, at: int) -> int:
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None or not (stamp.sec or stamp.nanosec):
        return at
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _field(message: Any, path: str, absent: set[str]) -> float:
    """Number at ``path`` of a message, NaN where it is none; paths that it does not have go into ``absent``."""
    value = message
    for step in path.split("."):
        found = _STEP.match(step)
        value = getattr(value, found["name"], None) if found else None
        if value is not None and found and found["index"] is not None:
            value = _element(message, value, found["index"])
        if value is None:
            absent.add(path)
            return float("nan")
    try:
        return float(value)
    except (TypeError, ValueError):
        absent.add(path)
        return float("nan")


def _element(message: Any, values: Any, index: str) -> Any:
    names = list(getattr(message, "name", ()))
    place = names.index(index) if index in names else int(index) if index.isdigit() else len(values)
    return values[place] if place < len(values) else None


def _note(message: Any) -> dict[str, Any]:
    try:
        found = json.loads(str(message.data))
    except (AttributeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
