"""A circle with thin radial plates across a plane flow: apparent mass, and the vortices that stand for the plates.

The section of a hull with strakes, as slender-body theory sees it. Velocities (3,): along y and z [m/s], roll [rad/s].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array

NODES = 12
"""Vortices on a plate. Lateral motion is exact to 1e-12 from 8 on, roll to 5e-4 at 12: the corner at the root."""


@dataclass(frozen=True)
class Section:
    """A circle of ``radius`` [m] with plates.

    added (3, 3) : apparent mass over density gained by the plates [m2, m3, m4].
    circulation (n, 3) : of the vortices, per unit velocity [m, m2], right-handed about x.   r, azimuth (n,) : places.
    """

    radius: float
    added: Array
    circulation: Array
    r: Array
    azimuth: Array


def finned_circle(radius: float, azimuths: Array, tips: Array) -> Section:
    """Section of a circle of ``radius`` [m] with plates at ``azimuths`` (k,) [rad] up to the radii ``tips`` (k,) [m].

    In w = ln(z / radius) the plates are parallel and the circle is a line. With their mirror images they are slits
    whose sheets are singular at both ends, which Chebyshev-Gauss points integrate exactly; the flow is tangent to the
    plates at the points between.

    Source     The circle theorem and Chebyshev collocation of a slit (katzplotkin2001, chapter 6). The apparent mass is
               the moment of the sheet's circulation: bryson1953 for the closed forms that it reproduces.
    Valid      Thin plates, tips beyond the circle; attached flow at the root.
    """
    reach = np.log(np.asarray(tips, dtype=float) / radius)
    azimuth = np.asarray(azimuths, dtype=float)
    step = np.pi / (4 * NODES)
    at = (reach[:, None] * np.cos(step * (2 * np.arange(NODES) + 1)) + 1j * azimuth[:, None]).ravel()
    met = (reach[:, None] * np.cos(step * 2 * (np.arange(NODES) + 1)) + 1j * azimuth[:, None]).ravel()
    influence = (1.0 / np.tanh(0.5 * (met[:, None] - at)) - 1.0 / np.tanh(0.5 * (met[:, None] + at.conj()))) / (
        4j * np.pi
    )
    r, along = radius * np.exp(met.real), met.imag
    asked = np.stack([-np.sin(along) * (r + radius**2 / r), np.cos(along) * (r + radius**2 / r), r * r], axis=1)
    circulation = -np.linalg.solve(influence.imag, asked)
    r, along = radius * np.exp(at.real), at.imag
    moment = np.stack([-np.sin(along) * (r - radius**2 / r), np.cos(along) * (r - radius**2 / r),
                       0.5 * (r * r - radius**2)], axis=1)  # fmt: skip
    added = -moment.T @ circulation
    return Section(radius, 0.5 * (added + added.T), circulation, r, along)


def wash(section: Section, radius: float, y: Array, azimuth: float, core: float) -> Array:
    """Velocity (n, 3) along (-sin, cos) of ``azimuth`` at the radii ``y`` (n,) [m], per unit velocity of ``section``.

    The vortices trail aft along the hull, which is a circle of ``radius`` [m] here: r^2 - radius^2 keeps its value, as
    on the streamlines of a slender body. ``core`` [m] is the radius within which they turn as a solid.

    Source     Trailing vortices with their images in the hull: pitts1957, wing-tail interference.
    Departure  The sheet stays as it is shed, flat; there it is rolled up into one vortex a plate.
    """
    r = np.sqrt(radius**2 + section.r**2 - section.radius**2)
    place = r * np.exp(1j * section.azimuth)
    image = radius**2 / place.conj()
    point = np.asarray(y, dtype=float) * np.exp(1j * azimuth)

    def turning(source: NDArray[np.complex128]) -> NDArray[np.complex128]:
        apart = point[:, None] - source
        squared = np.abs(apart) ** 2
        return np.array(apart.conj() / (squared + core**2) / (2j * np.pi))

    flow = (turning(place) - turning(image)) @ section.circulation
    return np.asarray(-(flow * np.exp(1j * azimuth)).imag)
