"""Records as bags of ROS 1 and ROS 2, by the library ``rosbags``; axes of REP 103."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import replace_file
from towtank.errors import InputError
from towtank.field.log import CHANNELS, FINS, SeaLog
from towtank.field.reading.note import note_text
from towtank.field.reading.ros import NOTE
from towtank.field.writing.vehicles import replace_folder
from towtank.frames import Array, rotation

SECOND = 10**9
_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
_FLU = np.diag([1.0, -1.0, -1.0])
_TWIST = ("u", "v", "w", "p", "q", "r")
_TOPICS = ("x", "y", "z", *_TWIST, "ahead", "slip", "plunge", "phi", "theta", "psi")
"""Channels that have messages of their own; all others are numbers of std_msgs/Float64."""
Sent = list[tuple[int, str, str, Any]]
"""Stamp [ns], topic, type, message."""


def write_ros1(log: SeaLog, path: Path) -> Path:
    """A record as a ROS 1 bag.

    Raises
    ------
    InputError
        ``rosbags`` is not installed.
    ArtefactError
        The folder cannot be written.
    """
    stores, get_typestore = _library(path)
    from rosbags.rosbag1 import Writer

    types = get_typestore(stores.ROS1_NOETIC)

    def write(part: Path) -> None:
        part.unlink(missing_ok=True)
        with Writer(part) as writer:
            _send(writer, log, types, types.serialize_ros1)

    return replace_file(path, write)


def write_ros2(log: SeaLog, path: Path, plugin: str = "SQLITE3") -> Path:
    """A record as a ROS 2 bag: a folder; ``plugin`` is SQLITE3 or MCAP.

    Raises
    ------
    InputError
        ``rosbags`` is not installed.
    ArtefactError
        The folder cannot be written, or holds something else.
    """
    stores, get_typestore = _library(path)
    from rosbags.rosbag2 import StoragePlugin, Writer

    types = get_typestore(stores.ROS2_HUMBLE)

    def fill(part: Path) -> None:
        with Writer(part, version=9, storage_plugin=StoragePlugin[plugin]) as writer:
            _send(writer, log, types, types.serialize_cdr)
        for file in part.iterdir():  # the library names the data after the folder, which still has its temporary name
            if part.name in file.name:
                file.rename(part / file.name.replace(part.name, path.name))
        notes = part / "metadata.yaml"
        notes.write_text(notes.read_text(encoding="utf-8").replace(part.name, path.name), encoding="utf-8")

    return replace_folder(path, fill, "metadata.yaml")


def _library(path: Path) -> tuple[Any, Any]:
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(f'{path}: writing a bag needs rosbags. Install it: pip install "towtank[field]".') from None
    return Stores, get_typestore


def _send(writer: Any, log: SeaLog, types: Any, encode: Callable[[Any, str], Any]) -> None:
    connections: dict[str, Any] = {}
    for at, topic, kind, message in _messages(log, types.types):
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, kind, typestore=types)
        writer.write(connections[topic], at, encode(message, kind))


def _messages(log: SeaLog, t: Any) -> Sent:
    """Messages of a record in the order of time; a vector holds NaN where one of its parts was not measured."""
    start = round((log.epoch or 0.0) * SECOND)
    stamps = [start + round(at * SECOND) for at in log.time.tolist()]
    sent: Sent = [(stamps[0], NOTE, "std_msgs/msg/String", t["std_msgs/msg/String"](data=note_text(log)))]
    sent += _odometry(log, stamps, t)
    water = np.stack([log[name] for name in ("ahead", "slip", "plunge")], axis=-1) @ _FLU
    for i in np.flatnonzero(np.isfinite(water).any(axis=-1)):
        twist = _twist(t, np.concatenate([water[i], np.zeros(3)]))
        kind = "geometry_msgs/msg/TwistStamped"
        sent.append(
            (stamps[i], "/towtank/through_water", kind, t[kind](header=_header(t, stamps[i], "body"), twist=twist))
        )
    for word, topic in (("delta", "/towtank/fins"), ("command", "/towtank/fins_asked")):
        angles = np.stack([log[f"{word}{k + 1}"] for k in range(FINS)], axis=-1)
        for i in np.flatnonzero(np.isfinite(angles).any(axis=-1)):
            sent.append((stamps[i], topic, "sensor_msgs/msg/JointState", _joints(t, stamps[i], word, angles[i])))
    number = t["std_msgs/msg/Float64"]
    for name, values in _numbers(log).items():
        for i in np.flatnonzero(np.isfinite(values)):
            sent.append((stamps[i], f"/towtank/{name}", "std_msgs/msg/Float64", number(data=float(values[i]))))
    return sorted(sent, key=lambda item: item[0])


def _numbers(log: SeaLog) -> dict[str, Array]:
    """Topic -> values of the channels that are sent as single numbers."""
    own = [f"{word}{k + 1}" for word in ("delta", "command") for k in range(FINS)]
    out = {name: log[name] for name in CHANNELS if name in log.channels and name not in (*_TOPICS, *own)}
    if not _whole(log):
        held = {"roll": log["phi"], "pitch": -log["theta"], "yaw": 0.5 * np.pi - log["psi"]}
        out |= {name: values for name, values in held.items() if np.isfinite(values).any()}
    return out


def _whole(log: SeaLog) -> bool:
    """Whether the attitude is known altogether or not at all at each time."""
    known = [np.isfinite(log[name]) for name in ("phi", "theta", "psi")]
    return bool(np.array_equal(known[0], known[1]) and np.array_equal(known[1], known[2]))


def _odometry(log: SeaLog, stamps: list[int], t: Any) -> Sent:
    position = np.stack([log[name] for name in "xyz"], axis=-1) @ _ENU.T
    nu = np.stack([log[name] for name in _TWIST], axis=-1) @ np.kron(np.eye(2), _FLU)
    turned = np.full((len(stamps), 4), np.nan)
    attitude = np.stack([log[name] for name in ("phi", "theta", "psi")], axis=-1)
    known = np.isfinite(attitude).all(axis=-1)
    if _whole(log) and known.any():
        turned[known] = _quaternions(_ENU @ rotation(attitude[known]) @ _FLU)
    kind = "nav_msgs/msg/Odometry"
    out: Sent = []
    for i in np.flatnonzero(np.isfinite(np.hstack([position, nu, turned])).any(axis=-1)):
        x, y, z = position[i].tolist()
        qw, qx, qy, qz = turned[i].tolist()
        pose = t["geometry_msgs/msg/Pose"](
            position=t["geometry_msgs/msg/Point"](x=x, y=y, z=z),
            orientation=t["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
        )
        message = t[kind](
            header=_header(t, stamps[i], "map"), child_frame_id="base_link",
            pose=t["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
            twist=t["geometry_msgs/msg/TwistWithCovariance"](twist=_twist(t, nu[i]), covariance=np.zeros(36)),
        )  # fmt: skip
        out.append((stamps[i], "/towtank/odometry", kind, message))
    return out


def _header(t: Any, stamp: int, frame: str) -> Any:
    kind = t["std_msgs/msg/Header"]
    time = t["builtin_interfaces/msg/Time"](sec=stamp // SECOND, nanosec=stamp % SECOND)
    more = {"seq": 0} if "seq" in kind.__dataclass_fields__ else {}
    return kind(stamp=time, frame_id=frame, **more)


def _twist(t: Any, nu: Array) -> Any:
    vector = t["geometry_msgs/msg/Vector3"]
    parts = [vector(x=float(a), y=float(b), z=float(c)) for a, b, c in (nu[:3], nu[3:])]
    return t["geometry_msgs/msg/Twist"](linear=parts[0], angular=parts[1])


def _joints(t: Any, stamp: int, word: str, angles: Array) -> Any:
    none = np.zeros(0)
    names = [f"{word}{k + 1}" for k in range(FINS)]
    kind = t["sensor_msgs/msg/JointState"]
    return kind(header=_header(t, stamp, "body"), name=names, position=angles.copy(), velocity=none, effort=none)


def _quaternions(cosines: Array) -> Array:
    """Unit quaternions (N, 4), scalar part first, of body-to-world cosines (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(np.roll(Rotation.from_matrix(cosines).as_quat(), 1, axis=-1))
