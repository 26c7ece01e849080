"""Latitude and longitude to metres north and east of a datum, and back."""

from __future__ import annotations

import numpy as np

from towtank.frames import Array

SEMI_MAJOR = 6378137.0
"""Of the WGS-84 ellipsoid [m]."""
FLATTENING = 1.0 / 298.257223563
_E2 = FLATTENING * (2.0 - FLATTENING)


def radii(latitude: Array | float) -> tuple[Array, Array]:
    """Radii of curvature [m] of the WGS-84 ellipsoid at ``latitude`` [rad]: in the meridian, and across it.

    Source     snyder1987, eq. 4-18 and 4-20.
    """
    root = np.sqrt(1.0 - _E2 * np.sin(latitude) ** 2)
    return np.asarray(SEMI_MAJOR * (1.0 - _E2) / root**3), np.asarray(SEMI_MAJOR / root)


def north_east(latitude: Array, longitude: Array, datum: tuple[float, float]) -> tuple[Array, Array]:
    """Metres north and east (N,) in the plane that touches the ellipsoid at ``datum`` (latitude, longitude) [rad].

    Source     fossen2021, ch. 2: geodetic to Earth-centred coordinates, and those turned into the tangent plane.
    Valid      Points at the height of the ellipsoid. A point 100 m deep is off by 1.6e-5 of its distance; distances in
               the plane are short by the square of distance / radius over 6: 4 mm at 10 km.
    """
    x, y, z = _centred(latitude, longitude)
    x0, y0, z0 = _centred(np.asarray(datum[0]), np.asarray(datum[1]))
    sp, cp, sl, cl = np.sin(datum[0]), np.cos(datum[0]), np.sin(datum[1]), np.cos(datum[1])
    dx, dy, dz = x - x0, y - y0, z - z0
    return np.asarray(-sp * cl * dx - sp * sl * dy + cp * dz), np.asarray(-sl * dx + cl * dy)


def latitude_longitude(north: Array, east: Array, datum: tuple[float, float]) -> tuple[Array, Array]:
    """Latitude and longitude (N,) [rad] of points of the tangent plane: ``north_east`` undone by Newton's method.

    Source     snyder1987, eq. 4-18 and 4-20, as the slopes of Newton's method.
    Valid      Up to 1000 km from the datum, and datums below 85 deg of latitude.
    """
    phi, lam = np.full(np.shape(north), datum[0]), np.full(np.shape(east), datum[1])
    for _ in range(20):
        n, e = north_east(phi, lam, datum)
        meridian, across = radii(phi)
        step_n, step_e = (north - n) / meridian, (east - e) / (across * np.cos(phi))
        phi, lam = phi + step_n, lam + step_e
        if not len(step_n) or np.nanmax(np.abs(step_n) + np.abs(step_e), initial=0.0) < 1e-15:
            break
    return phi, lam


def _centred(latitude: Array, longitude: Array) -> tuple[Array, Array, Array]:
    """Earth-centred coordinates [m] of points on the ellipsoid."""
    _, across = radii(latitude)
    flat = across * np.cos(latitude)
    return flat * np.cos(longitude), flat * np.sin(longitude), across * (1.0 - _E2) * np.sin(latitude)
