"""Commented mapping files to edit, one for each format of logs."""

from __future__ import annotations

from collections.abc import Mapping

from towtank.errors import InputError
from towtank.field.reading.mapping import FORMATS

_HEAD = """\
# Mapping of a log of a craft at sea, for `towtank log FILE --map this.toml`. Every key: docs/sea-logs.md.
# A bare number is SI; a bare angle is refused.
schema = "towtank/sea-log/1"
format = "{form}"
{extends}craft = "hokie"              # of the library, or a craft.toml beside this file: origin, fins and their sense
convention = "{axes}"           # "ned": north east down, forward starboard down; "ros": east north up, forward port up
# body = ["x", "-y", "-z"]   # in place of it: the file's axes that point forward, starboard and down
# world = ["y", "x", "-z"]   # and those that point north, east and down
fins = "vehicle"             # angles in the vehicle's own sense (sign in the craft file); "towtank" when they are ours
# declination = "-10.5 deg"  # added to channels that are magnetic = true
# datum = {{ latitude = "36.95 deg", longitude = "-76.32 deg" }}   # of x = y = 0; the first fix when left out
"""
_CLOCK: Mapping[str, str] = {
    "table": """
[clock]
columns = ["{time}"]             # kind "date" takes ["Date", "Time"]; kind "gps" takes ["week", "seconds"]
kind = "elapsed"             # elapsed, epoch, iso, date, "time of day", gps or matlab
unit = "s"                   # of numbers: s, ms, us, ns
# order = "mdy"              # of the parts of a date
# utc_offset = "2 h"         # of the clock ahead of UTC
# reset = "continue"         # a clock that starts again goes on; "keep out" is what is done otherwise
""",
    "own": """
# The file times its own rows. step puts all on uniform ticks; within joins stamps that are one instant.
[clock]
within = "0.1 ms"
# step = "0.1 s"
""",
}
_SENSORS = """
# Places of sensors, body axes: from_nose aft of the nose, or x forward of the body origin; y starboard, z down.
[sensors.gps]
from_nose = "1.2 m"
z = "-0.12 m"

[sensors.dvl]
from_nose = "0.8 m"
z = "0.09 m"
"""
_ROWS: Mapping[str, tuple[str, ...]] = {
    "time": ("t", "t", "nav.t", "", ""),
    "latitude": ("lat", "lat", "nav.lat", "NAV_LAT", "/gps/fix:latitude"),
    "longitude": ("lon", "lon", "nav.lon", "NAV_LONG", "/gps/fix:longitude"),
    "z": ("depth", "depth", "nav.depth", "NAV_DEPTH", "/odom:pose.pose.position.z"),
    "psi": ("heading", "heading", "nav.heading", "NAV_HEADING", "/odom:pose.pose.orientation"),
    "theta": ("pitch", "pitch", "nav.pitch", "NAV_PITCH", ""),
    "phi": ("roll", "roll", "nav.roll", "NAV_ROLL", ""),
    "r": ("yaw_rate", "yaw_rate", "imu.r", "IMU_R", "/imu:angular_velocity.z"),
    "u": ("dvl_x", "dvl_x", "dvl.u", "DVL_U", "/odom:twist.twist.linear.x"),
    "delta": ("servo", "servo", "servo.s", "SERVO_", "/fins:position"),
    "revolutions": ("rpm", "rpm", "motor.rpm", "MOTOR_RPM", "/motor:data"),
}
_PLACES = {"csv": 0, "netcdf": 1, "mat": 2, "alog": 3, "ros": 4}


def template(form: str) -> str:
    """A mapping to edit for logs of ``form``, a word of ``FORMATS`` or "iver".

    Raises
    ------
    InputError
        No such format.
    """
    if form not in (*FORMATS, "iver"):
        raise InputError(f"--template {form!r} is unknown. Write one of {', '.join((*FORMATS, 'iver'))}.")
    if form in ("imc", "iver"):
        return _extended(form)
    place = _PLACES[form]
    head = _HEAD.format(form=form, extends="", axes="ros" if form == "ros" else "ned")
    own = form in ("alog", "ros")
    clock = _CLOCK["own"] if own else _CLOCK["table"].format(time=_ROWS["time"][place])
    return head + clock + _SENSORS + _channels(place, form)


def _channels(place: int, form: str) -> str:
    def name(key: str) -> str:
        return _ROWS[key][place]

    fins = [f"{name('delta')}[{i}]" if form == "ros" else f"{name('delta')}{i + 1}" for i in range(4)]
    lines = [
        "",
        "# Names on the left: docs/sea-logs.md. unit where the file does not say it. std, bias: of the noise.",
        "[channels]",
        f'latitude = {{ column = "{name("latitude")}", unit = "deg", sensor = "gps", std = "1.5 m" }}',
        f'longitude = {{ column = "{name("longitude")}", unit = "deg", sensor = "gps", std = "1.5 m" }}',
        f'z = {{ column = "{name("z")}", unit = "m", std = "0.05 m" }}',
    ]
    if form == "ros":
        turn = name("psi")
        lines += [f'q{part} = "{turn}.{part}"' for part in "wxyz"]
    else:
        lines += [
            f'psi = {{ column = "{name("psi")}", unit = "deg", magnetic = false, std = "0.5 deg" }}',
            f'theta = {{ column = "{name("theta")}", unit = "deg" }}',
            f'phi = {{ column = "{name("phi")}", unit = "deg" }}',
        ]
    rate = "rad/s" if form == "ros" else "deg/s"
    lines += [
        f'r = {{ column = "{name("r")}", unit = "{rate}" }}',
        f'u = {{ column = "{name("u")}", unit = "m/s", sensor = "dvl", std = "0.01 m/s", missing = [-32.768] }}',
    ]
    if form == "ros":
        lines += [f'delta{i + 1} = {{ column = "{fin}", unit = "rad" }}' for i, fin in enumerate(fins)]
    else:
        lines += [
            f'delta1 = {{ column = "{fins[0]}", counts = {{ zero = 1500, per_unit = 10, unit = "deg" }} }}',
            f'delta2 = {{ column = "{fins[1]}", points = [[1200, "-30 deg"], [1800, "30 deg"]] }}',
            f'delta3 = {{ column = "{fins[2]}", unit = "deg", factor = -1 }}',
            f'delta4 = {{ column = "{fins[3]}", unit = "deg" }}      # or "delta:upper" by its name in the craft file',
        ]
    return "\n".join([*lines, f'revolutions = {{ column = "{name("revolutions")}", unit = "rpm" }}', ""])


def _extended(form: str) -> str:
    head = _HEAD.format(form="csv" if form == "iver" else form, extends=f'extends = "{form}"\n', axes="ned")
    if form == "iver":
        fins = ("Fin Yaw T", "Fin Yaw B", "Fin Pitch R", "Fin Pitch L")
        rows = [
            f'delta{i + 1} = {{ column = "{fin}", counts = {{ zero = 128, per_unit = 3.2, unit = "deg" }} }}'
            for i, fin in enumerate(fins)
        ]
        words = "# The ready schema reads the rest. Zero and scale of the fins' counts are the vehicle's: measure them."
    else:
        rows = [
            f'delta{i + 1} = {{ column = "ServoPosition:value", unit = "rad", where = {{ id = {i} }} }}'
            for i in range(4)
        ]
        words = "# The ready schema reads the rest. Which servo is which fin is the vehicle's: look."
    return "\n".join([head, words, "[channels]", *rows, ""])
