"""A motion known in closed form, and logs of it in the shapes in which craft write them.

``python tests/sea_samples.py`` writes tests/data/logs. All of it is made up: no craft was at sea.
"""

from __future__ import annotations

import datetime
import shutil
from pathlib import Path

import numpy as np

from towtank.field.reading.geodesy import latitude_longitude
from towtank.frames import rotation

FOLDER = Path(__file__).parent / "data" / "logs"
EPOCH = datetime.datetime(2026, 5, 2, 9, 30, 0, tzinfo=datetime.UTC).timestamp()
DATUM = (np.radians(36.95), np.radians(-76.32))
GPS = np.array([0.9, 0.1, -0.2])
DVL = np.array([0.4, -0.05, 0.15])
DEPTH_CELL = np.array([-0.7, 0.0, 0.1])
MADE_UP = "SYNTHETIC: made up by the project, no craft was at sea"
RATE = 10.0


def attitude(t):
    return np.stack([0.08 * np.sin(0.7 * t), 0.05 * np.cos(0.4 * t), 5.9 + 0.1 * t], axis=-1)


def place(t):
    """Place (N, 3) of the body origin."""
    return np.stack([30.0 * np.sin(0.05 * t), 1.5 * t + np.cos(0.3 * t), 4.0 + 0.5 * np.sin(0.2 * t)], axis=-1)


def place_of(t, arm):
    """Place (N, 3) of a point fixed in the body."""
    return place(t) + np.einsum("nij,j->ni", rotation(attitude(t)), arm)


def velocity_of(t, arm=(0.0, 0.0, 0.0)):
    """Velocity (N, 3) over ground of such a point along body axes: its place differentiated, nothing else."""
    h = 1e-4
    ground = (place_of(t + h, np.asarray(arm)) - place_of(t - h, np.asarray(arm))) / (2.0 * h)
    return np.einsum("nji,nj->ni", rotation(attitude(t)), ground)


def rates(t):
    """p, q, r (N, 3) from the cosines differentiated."""
    h = 1e-4
    change = (rotation(attitude(t + h)) - rotation(attitude(t - h))) / (2.0 * h)
    spin = np.einsum("nji,njk->nik", rotation(attitude(t)), change)
    return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)


def fins(t):
    return np.stack([np.radians(a) * np.sin(w * t) for a, w in ((5, 0.5), (8, 0.6), (3, 0.7), (6, 0.8))], axis=-1)


def truth(t):
    """Channel -> values of the body origin [SI]."""
    columns = {}
    for names, values in (
        ("x y z", place(t)), ("phi theta psi", attitude(t)), ("u v w", velocity_of(t)), ("p q r", rates(t)),
        ("delta1 delta2 delta3 delta4", fins(t)),
    ):  # fmt: skip
        columns |= dict(zip(names.split(), values.T, strict=True))
    return columns | {"revolutions": 12.0 + np.sin(0.3 * t)}


def clock(seconds=6.0, rate=RATE):
    return np.arange(round(seconds * rate)) / rate


def heading(psi):
    return np.degrees(psi) % 360.0


def main(folder: Path = FOLDER) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for write in (kestrel, iso, iver, imc, moos, mat, mat73, netcdf, ros1, ros2):
        write(folder)


def kestrel(folder):
    """Semicolons, decimal commas, milliseconds, degrees, knots, wrapped magnetic heading, servo counts, lever arms."""
    t = clock()
    lat, lon = (np.degrees(a) for a in latitude_longitude(*place_of(t, GPS)[:, :2].T, DATUM))
    d = truth(t)
    dvl = velocity_of(t, DVL)
    depth = place_of(t, DEPTH_CELL)[:, 2]
    head = "t_ms;lat;lon;depth (m);heading (deg);pitch (deg);roll (deg);p;q;r;dvl_x (kn);dvl_y (kn);dvl_z (kn);"
    head += "s1;s2;s3;s4;mode"
    lines = [f"# {MADE_UP}", head]
    for i, at in enumerate(t):
        counts = [1500.0 + 10.0 * np.degrees(d[f"delta{k + 1}"][i]) for k in range(4)]
        row = [
            f"{1000 * at:.0f}", f"{lat[i]:.9f}", f"{lon[i]:.9f}", f"{depth[i]:.4f}",
            f"{heading(d['psi'][i] + np.radians(10.5)):.4f}", f"{np.degrees(d['theta'][i]):.4f}",
            f"{np.degrees(d['phi'][i]):.4f}", *(f"{np.degrees(d[n][i]):.4f}" for n in "pqr"),
            *(f"{x / 0.5144444444444445:.5f}" for x in dvl[i]), *(f"{c:.2f}" for c in counts),
        ]  # fmt: skip
        lines.append(";".join([*(cell.replace(".", ",") for cell in row), "AUTO"]))
    (folder / "kestrel.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "kestrel.toml").write_text(KESTREL, encoding="utf-8")


def iso(folder):
    """Commas, ISO times, radians, east-north-up, a sentinel, a last line that was cut off."""
    t = clock(6.0)
    d = truth(t)
    lines = [f"# {MADE_UP}", "stamp,east,north,up,yaw [rad],pitch [rad],roll [rad],fin1 [deg],note"]
    for i, at in enumerate(t):
        stamp = datetime.datetime.fromtimestamp(EPOCH + at, tz=datetime.UTC).isoformat(timespec="milliseconds")
        up = -9999.0 if i == 7 else -d["z"][i]
        row = [d["y"][i], d["x"][i], up, 0.5 * np.pi - d["psi"][i], -d["theta"][i], d["phi"][i]]
        lines.append(",".join([stamp, *(f"{x:.6f}" for x in row), f"{np.degrees(d['delta1'][i]):.4f}", "ok"]))
    lines.append("2026-05-02T09:30:06.000+00:00,8.9")
    (folder / "heron.csv").write_text("\n".join(lines), encoding="utf-8")
    (folder / "heron.toml").write_text(HERON, encoding="utf-8")


def iver(folder):
    """As the control program of an Iver writes it: one row a second, no fix below the surface, fins as counts."""
    t = clock(40.0, 1.0)
    d = truth(t)
    lat, lon = (np.degrees(a) for a in latitude_longitude(d["x"], d["y"], DATUM))
    head = ("Latitude;Longitude;Time;Date;Number of Sats;GPS Speed (Kn);C Magnetic Heading;C True Heading;Pitch Angle;"
            "Roll Angle;C Inside Temp (c);DFS Depth (m);Batt State;Next Speed (kn);Vehicle Speed (kn);Motor Speed CMD;"
            "Next Heading;Depth Goal (m);Vehicle State;Error State;Fin Pitch R;Fin Pitch L;Fin Yaw T;"
            "Fin Yaw B;")  # fmt: skip
    lines = [head]
    for i, at in enumerate(t):
        stamp = datetime.datetime.fromtimestamp(EPOCH + at, tz=datetime.UTC)
        blind = 12 <= i < 15
        place = ["0", "0"] if blind else [f"{lat[i]:.8f}", f"{lon[i]:.8f}"]
        speed = np.hypot(d["u"][i], d["v"][i]) / 0.5144444444444445
        counts = [f"{128.0 + 3.2 * np.degrees(d[f'delta{k}'][i]):.1f}" for k in (3, 4, 1, 2)]
        day = f"{stamp.month}/{stamp.day}/{stamp.year}"
        row = [*place, f"{stamp.hour}:{stamp:%M:%S}.00", day, "0" if blind else "9", "0",
               f"{heading(d['psi'][i]):.1f}", f"{heading(d['psi'][i]):.2f}", f"{np.degrees(d['theta'][i]):.2f}",
               f"{np.degrees(d['phi'][i]):.2f}", "31.2", f"{d['z'][i]:.3f}", "N", "3.0", f"{speed:.3f}", "160", "90.0",
               "5.0", "SYNTHETIC", "SYNTHETIC", *counts]  # fmt: skip
        lines.append(";".join(row) + ";")
    (folder / "iver.log").write_text("\r\n".join(lines) + "\r\n", encoding="utf-8", newline="")


def imc(folder):
    """As Neptus exports the messages of DUNE: a file for each, clocks of their own, orders when they change."""
    place = folder / "imc"
    place.mkdir(exist_ok=True)
    head = "timestamp (seconds since 01/01/1970), system, entity "

    def message(name, fields, rows):
        lines = [f"{head}, {fields}", *(f"{EPOCH + at:.6f}, lauv-sample, Main, {cells}" for at, cells in rows)]
        (place / f"{name}.csv").write_text("\r\n".join(lines) + "\r\n", encoding="utf-8", newline="")

    t = clock()
    d = truth(t)
    wrapped = d | {"psi": (d["psi"] + np.pi) % (2.0 * np.pi) - np.pi}
    state = ["x", "y", None, "phi", "theta", "psi", "u", "v", "w", None, None, None, "p", "q", "r", "z", None]
    message(
        "EstimatedState",
        "lat (rad), lon (rad), height (m), x (m), y (m), z (m), phi (rad), theta (rad), psi (rad), u (m/s), v (m/s), "
        "w (m/s), vx (m/s), vy (m/s), vz (m/s), p (rad/s), q (rad/s), r (rad/s), depth (m), alt (m)",
        [
            (at, f"{DATUM[0]:.8f}, {DATUM[1]:.8f}, 0, " + ", ".join(
                "0" if name is None else f"{wrapped[name][i]:.6f}" for name in state))
            for i, at in enumerate(t)
        ],
    )  # fmt: skip
    later = t[:-1] + 0.0503
    angles = fins(later)
    message(
        "ServoPosition",
        "id, value (rad)",
        [(at, f"{k}, {angles[i, k]:.6f}") for i, at in enumerate(later) for k in range(4)],
    )
    slow = clock(rate=2.0) + 0.02
    message("Rpm", "value (rpm)", [(at, f"{60.0 * truth(np.array([at]))['revolutions'][0]:.3f}") for at in slow])
    message("DesiredHeading", "value (rad)", [(0.5, "0.2"), (4.0, "1.2")])
    message("DesiredZ", "value (m), z_units", [(0.4, "4, DEPTH"), (3.0, "2.5, ALTITUDE"), (4.5, "5, DEPTH")])
    message(
        "LogBookEntry",
        "type, htime (s), context, text",
        [(0.0, f"INFO, {EPOCH:.3f}, sample, {MADE_UP.replace(', ', '; ')}")],
    )


def moos(folder):
    """As pLogger of MOOS-IvP writes it: every variable when it is posted, some of them text."""
    t = clock()
    posted = [(0.0, "DB_TIME", "MOOSDB_sample", f"{EPOCH:.3f}"), (0.001, "SAMPLE_NOTE", "pSample", MADE_UP)]
    d, angles = truth(t + 0.001), np.degrees(fins(t + 0.031))
    for i, at in enumerate(t):
        posted += [
            (at + 0.001, "NAV_X", "pNav", f"{d['y'][i]:.5f}"), (at + 0.001, "NAV_Y", "pNav", f"{d['x'][i]:.5f}"),
            (at + 0.001, "NAV_DEPTH", "pNav", f"{d['z'][i]:.5f}"),
            (at + 0.001, "NAV_HEADING", "pNav", f"{heading(d['psi'][i]):.5f}"),
            (at + 0.031, "FIN_STATE", "iFins", ",".join(f"FIN{k + 1}={angles[i, k]:.4f}" for k in range(4))),
        ]  # fmt: skip
    posted += [(0.2, "DESIRED_RUDDER", "pHelm", "3.5"), (4.2, "DESIRED_RUDDER", "pHelm", "-2")]
    lines = ["%" * 60, "%% LOG FILE:       moos.alog", "%% FILE OPENED ON  Sat May  2 09:30:00 2026",
             f"%% LOGSTART               {EPOCH:.2f}", "%" * 60]  # fmt: skip
    lines += [f"{at:<15.3f} {name:<20} {source:<15} {value}" for at, name, source, value in sorted(posted)]
    lines.insert(40, "garbage")
    (folder / "moos.alog").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "moos.toml").write_text(MOOS, encoding="utf-8")


def _arrays():
    t = clock()
    d = truth(t)
    slow = clock(rate=1.0)
    lat, lon = (np.degrees(a) for a in latitude_longitude(*place_of(slow, GPS)[:, :2].T, DATUM))
    return t, d, slow, lat, lon


def mat(folder):
    """Structures of a program in MATLAB; GPS with a clock of its own; days since year 0."""
    from scipy.io import savemat

    t, d, slow, lat, lon = _arrays()
    days = 719529.0 + (EPOCH + t) / 86400.0
    nav = {"t": days, "heading": heading(d["psi"]), "pitch": np.degrees(d["theta"]), "roll": np.degrees(d["phi"]),
           "depth": d["z"], "u": d["u"], "v": d["v"], "w": d["w"]}  # fmt: skip
    gps = {"t": 719529.0 + (EPOCH + slow) / 86400.0, "lat": lat, "lon": lon}
    content = {"remark": MADE_UP, "nav": nav, "gps": gps, "servo": np.degrees(fins(t))[:, :1]}
    with (folder / "osprey.mat").open("wb") as file:
        savemat(file, content, do_compression=True, oned_as="column")
    (folder / "osprey.toml").write_text(OSPREY, encoding="utf-8")


def mat73(folder):
    """The same in version 7.3."""
    import h5py

    t, d, slow, lat, lon = _arrays()
    path = folder / "osprey73.mat"
    with h5py.File(path, "w", userblock_size=512, track_order=False) as file:
        nav = file.create_group("nav")
        columns = {"t": 719529.0 + (EPOCH + t) / 86400.0, "heading": heading(d["psi"]), "pitch": np.degrees(d["theta"]),
                   "roll": np.degrees(d["phi"]), "depth": d["z"], "u": d["u"], "v": d["v"], "w": d["w"]}  # fmt: skip
        for name, values in columns.items():
            nav.create_dataset(name, data=values[None, :])
        gps = file.create_group("gps")
        for name, values in (("t", 719529.0 + (EPOCH + slow) / 86400.0), ("lat", lat), ("lon", lon)):
            gps.create_dataset(name, data=values[None, :])
        file.create_dataset("servo", data=np.degrees(fins(t))[None, :, 0])
        file.create_dataset("remark", data=np.frombuffer(MADE_UP.encode("utf-16-le"), dtype=np.uint16))
    head = b"MATLAB 7.3 MAT-file, made up by the project".ljust(124, b" ") + b"\x00\x02IM"
    content = path.read_bytes()
    path.write_bytes(head + content[128:])


def netcdf(folder):
    """Variables with units; times since a date."""
    from towtank.netcdf import Variable, encode

    t, d, *_ = _arrays()
    rows = {
        "time": (t, "seconds since 2026-05-02 09:30:00"), "north": (d["x"], "m"), "east": (d["y"], "m"),
        "depth": (d["z"], "m"), "heading": (heading(d["psi"]), "degrees"), "yaw_rate": (np.degrees(d["r"]), "deg/s"),
        "rudder": (d["delta1"], "rad"),
    }  # fmt: skip
    content = encode(
        {name: Variable(("time",), values, {"units": unit}) for name, (values, unit) in rows.items()},
        {"title": MADE_UP, "Conventions": "CF-1.10"},
    )
    (folder / "tern.nc").write_bytes(content)
    (folder / "tern.toml").write_text(TERN, encoding="utf-8")


def ros1(folder):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC)
    path = folder / "petrel.bag"
    path.unlink(missing_ok=True)
    with Writer(path) as writer:
        _send(writer, types, types.serialize_ros1)
    (folder / "petrel.toml").write_text(PETREL, encoding="utf-8")


def ros2(folder):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    for name, plugin in (("petrel2", StoragePlugin.SQLITE3), ("petrel3", StoragePlugin.MCAP)):
        shutil.rmtree(folder / name, ignore_errors=True)
        with Writer(folder / name, version=9, storage_plugin=plugin) as writer:
            _send(writer, types, types.serialize_cdr)


def _send(writer, store, encode):
    """Odometry, IMU, fix, pressure, thruster and fins, in the axes of REP 103."""
    from scipy.spatial.transform import Rotation

    T = store.types
    ns = 10**9

    def stamp(at):
        total = round((EPOCH + at) * ns)
        return T["builtin_interfaces/msg/Time"](sec=total // ns, nanosec=total % ns), total

    def header(at, frame):
        kind = T["std_msgs/msg/Header"]
        more = {"seq": 0} if "seq" in kind.__dataclass_fields__ else {}
        return kind(stamp=stamp(at)[0], frame_id=frame, **more)

    def vector(v):
        return T["geometry_msgs/msg/Vector3"](x=float(v[0]), y=float(v[1]), z=float(v[2]))

    t = clock(2.5)
    d = truth(t)
    enu, flu = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]), np.diag([1.0, -1, -1])
    quats = Rotation.from_matrix(enu @ rotation(attitude(t)) @ flu).as_quat()
    sent = []
    for i, at in enumerate(t):
        quat = T["geometry_msgs/msg/Quaternion"](**dict(zip("xyzw", map(float, quats[i]), strict=True)))
        pos = T["geometry_msgs/msg/Point"](x=float(d["y"][i]), y=float(d["x"][i]), z=float(-d["z"][i]))
        omega = flu @ np.array([d[n][i] for n in "pqr"])
        twist = T["geometry_msgs/msg/Twist"](
            linear=vector(flu @ velocity_of(t[i : i + 1], DVL)[0]), angular=vector(omega)
        )
        sent.append(
            (
                at,
                0.004,
                "/odom",
                "nav_msgs/msg/Odometry",
                dict(
                    header=header(at, "odom"),
                    child_frame_id="base_link",
                    pose=T["geometry_msgs/msg/PoseWithCovariance"](
                        pose=T["geometry_msgs/msg/Pose"](position=pos, orientation=quat), covariance=np.zeros(36)
                    ),
                    twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)),
                ),
            )
        )
        sent.append(
            (
                at,
                0.002,
                "/imu/data",
                "sensor_msgs/msg/Imu",
                dict(
                    header=header(at, "imu"),
                    orientation=quat,
                    orientation_covariance=np.zeros(9),
                    angular_velocity=vector(omega),
                    angular_velocity_covariance=np.zeros(9),
                    linear_acceleration=vector(np.zeros(3)),
                    linear_acceleration_covariance=np.zeros(9),
                ),
            )
        )
        sent.append(
            (
                at,
                0.001,
                "/fins/joint_states",
                "sensor_msgs/msg/JointState",
                dict(
                    header=header(at, "fins"),
                    name=["upper", "lower"],
                    position=np.array(fins(t)[i, :2]),
                    velocity=np.zeros(0),
                    effort=np.zeros(0),
                ),
            )
        )
        sent.append((at, 0.0, "/thruster/rpm", "std_msgs/msg/Float64", dict(data=float(60.0 * d["revolutions"][i]))))
        if i % 5 == 0:
            pressure = 101325.0 + 1025.0 * 9.80665 * float(d["z"][i])
            sent.append(
                (
                    at,
                    0.0,
                    "/pressure",
                    "sensor_msgs/msg/FluidPressure",
                    dict(header=header(at, "cell"), fluid_pressure=pressure, variance=0.0),
                )
            )
    sent.append((0.0, 0.0, "/about", "std_msgs/msg/String", dict(data=MADE_UP)))
    connections = {}
    for at, late, topic, kind, fields in sorted(sent, key=lambda item: item[0] + item[1]):
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, kind, typestore=store)
        writer.write(connections[topic], stamp(at + late)[1], encode(T[kind](**fields), kind))


KESTREL = """\
# Sample mapping, of a log that is made up.
schema = "towtank/sea-log/1"
name = "kestrel dive 3"
synthetic = true
declination = "-10.5 deg"
datum = { latitude = "36.95 deg", longitude = "-76.32 deg" }

[clock]
columns = "t_ms"
unit = "ms"

[sensors]
gps = { x = "0.9 m", y = "0.1 m", z = "-0.2 m" }
dvl = { x = "0.4 m", y = "-0.05 m", z = "0.15 m" }
cell = { x = "-0.7 m", z = "0.1 m" }

[channels]
latitude = { column = "lat", unit = "deg", sensor = "gps", std = "1.5 m" }
longitude = { column = "lon", unit = "deg", sensor = "gps", std = "1.5 m", assumed = true }
z = { column = "depth", sensor = "cell", std = "5 cm", bias = "10 cm" }
psi = { column = "heading", magnetic = true }
theta = "pitch"
phi = "roll"
p = { column = "p", unit = "deg/s" }
q = { column = "q", unit = "deg/s" }
r = { column = "r", unit = "deg/s" }
u = { column = "dvl_x", sensor = "dvl" }
v = { column = "dvl_y", sensor = "dvl" }
w = { column = "dvl_z", sensor = "dvl" }
delta1 = { column = "s1", counts = { zero = 1500, per_unit = 10, unit = "deg" } }
delta2 = { column = "s2", counts = { zero = 1500, per_unit = 10, unit = "deg" } }
delta3 = { column = "s3", points = [[1400, "-10 deg"], [1600, "10 deg"]] }
delta4 = { column = "s4", counts = { zero = 1500, per_unit = 10, unit = "deg" } }
"""
HERON = """\
# Sample mapping, of a log that is made up: world east, north, up; body forward, port, up.
schema = "towtank/sea-log/1"
convention = "ros"
synthetic = true

[clock]
columns = "stamp"
kind = "iso"

[channels]
x = { column = "east", unit = "m" }
y = { column = "north", unit = "m" }
z = { column = "up", unit = "m", missing = [-9999] }
phi = "roll"
theta = "pitch"
psi = "yaw"
delta1 = "fin1"
"""
MOOS = """\
# Sample mapping, of a log that is made up: fins in one variable of text.
schema = "towtank/sea-log/1"
extends = "moos"
synthetic = true

[channels]
delta1 = { column = "FIN_STATE:FIN1", unit = "deg" }
delta2 = { column = "FIN_STATE:FIN2", unit = "deg" }
delta3 = { column = "FIN_STATE:FIN3", unit = "deg" }
delta4 = { column = "FIN_STATE:FIN4", unit = "deg" }
"""
OSPREY = """\
# Sample mapping, of a log that is made up: a MAT file with two clocks in days.
schema = "towtank/sea-log/1"
synthetic = true
datum = { latitude = "36.95 deg", longitude = "-76.32 deg" }

[clock]
columns = "nav.t"
kind = "matlab"

[sensors]
gps = { x = "0.9 m", y = "0.1 m", z = "-0.2 m" }

[channels]
latitude = { column = "gps.lat", unit = "deg", time = "gps.t", sensor = "gps" }
longitude = { column = "gps.lon", unit = "deg", time = "gps.t", sensor = "gps" }
psi = { column = "nav.heading", unit = "deg" }
theta = { column = "nav.pitch", unit = "deg" }
phi = { column = "nav.roll", unit = "deg" }
z = "nav.depth"
u = "nav.u"
v = "nav.v"
w = "nav.w"
delta1 = { column = "servo", unit = "deg" }
"""
TERN = """\
# Sample mapping, of a log that is made up.
schema = "towtank/sea-log/1"
synthetic = true

[clock]
columns = "time"

[channels]
x = "north"
y = "east"
z = "depth"
psi = "heading"
r = "yaw_rate"
delta1 = "rudder"
"""
PETREL = """\
# Sample mapping, of a log that is made up: messages of ROS in the axes of REP 103.
schema = "towtank/sea-log/1"
convention = "ros"
craft = "hokie"
synthetic = true

[sensors]
dvl = { x = "0.4 m", y = "-0.05 m", z = "0.15 m" }

[channels]
x = "/odom:pose.pose.position.x"
y = "/odom:pose.pose.position.y"
pressure = { column = "/pressure:fluid_pressure", std = "2 cm" }
qw = "/imu/data:orientation.w"
qx = "/imu/data:orientation.x"
qy = "/imu/data:orientation.y"
qz = "/imu/data:orientation.z"
p = { column = "/imu/data:angular_velocity.x", unit = "rad/s" }
q = { column = "/imu/data:angular_velocity.y", unit = "rad/s" }
r = { column = "/imu/data:angular_velocity.z", unit = "rad/s" }
u = { column = "/odom:twist.twist.linear.x", sensor = "dvl" }
v = { column = "/odom:twist.twist.linear.y", sensor = "dvl" }
w = { column = "/odom:twist.twist.linear.z", sensor = "dvl" }
delta1 = { column = "/fins/joint_states:position[upper]", unit = "rad" }
delta2 = { column = "/fins/joint_states:position[lower]", unit = "rad" }
revolutions = { column = "/thruster/rpm:data", unit = "rpm" }
"""


if __name__ == "__main__":
    main()
