"""The rigid body: mass matrix and Coriolis matrix (perron eq. 2.12 and 2.14)."""

from __future__ import annotations

from dataclasses import dataclass

from towtank.craft.craft import Craft
from towtank.model.algebra import Matrix, Vector
from towtank.water import GRAVITY


@dataclass(frozen=True)
class Body:
    """Constants of the rigid body and of the water it displaces, SI, about the body origin.

    m : mass [kg].   b : displaced mass [kg] (perron writes the buoyancy in kg).   xG, yG, zG : CG [m].
    xB, yB, zB : centre of buoyancy [m].   Ixx, Iyy, Izz : moments of inertia, Ixy, Ixz, Iyz : products of inertia
    [kg m2] (the tensor holds minus the products).   g : gravity [m/s2].
    """

    m: float
    b: float
    xG: float
    yG: float
    zG: float
    xB: float
    yB: float
    zB: float
    Ixx: float
    Iyy: float
    Izz: float
    Ixy: float
    Ixz: float
    Iyz: float
    g: float = GRAVITY


def body_of(craft: Craft, centre_of_buoyancy: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Body:
    """The rigid-body constants of ``craft``; ``centre_of_buoyancy`` (3,) [m] from the origin."""
    mass, tensor = craft.mass, craft.mass.inertia
    return Body(
        mass.mass,
        mass.displaced_mass,
        *mass.cg,
        *centre_of_buoyancy,
        Ixx=tensor[0][0],
        Iyy=tensor[1][1],
        Izz=tensor[2][2],
        Ixy=-0.5 * (tensor[0][1] + tensor[1][0]),
        Ixz=-0.5 * (tensor[0][2] + tensor[2][0]),
        Iyz=-0.5 * (tensor[1][2] + tensor[2][1]),
    )


def mass_matrix(body: Body) -> Matrix:
    """M_RB (6, 6) [kg, kg m, kg m2].

    Source     perron, eq. 2.12; fossen2021, ch. 3.
    """
    m, xG, yG, zG = body.m, body.xG, body.yG, body.zG
    return [
        [m, 0, 0, 0, m * zG, -m * yG],
        [0, m, 0, -m * zG, 0, m * xG],
        [0, 0, m, m * yG, -m * xG, 0],
        [0, -m * zG, m * yG, body.Ixx, -body.Ixy, -body.Ixz],
        [m * zG, 0, -m * xG, -body.Ixy, body.Iyy, -body.Iyz],
        [-m * yG, m * xG, 0, -body.Ixz, -body.Iyz, body.Izz],
    ]


def coriolis_matrix(body: Body, nu: Vector) -> Matrix:
    """C_RB(nu) (6, 6); the load on the body is -C_RB nu.

    Source     perron, eq. 2.14; fossen2021, ch. 3.
    Departure  The source prints 0 for w, v, w, u, v, u in the lower left block. They are put back: the load is the
               same, because the products cancel, and the matrix is skew-symmetric again.
    """
    m, xG, yG, zG = body.m, body.xG, body.yG, body.zG
    u, v, w, p, q, r = nu
    Lx = body.Ixx * p - body.Ixy * q - body.Ixz * r
    Ly = body.Iyy * q - body.Ixy * p - body.Iyz * r
    Lz = body.Izz * r - body.Ixz * p - body.Iyz * q
    c14, c15, c16 = m * (yG * q + zG * r), -m * (xG * q - w), -m * (xG * r + v)
    c24, c25, c26 = -m * (yG * p + w), m * (zG * r + xG * p), -m * (yG * r - u)
    c34, c35, c36 = -m * (zG * p - v), -m * (zG * q + u), m * (xG * p + yG * q)
    return [
        [0, 0, 0, c14, c15, c16],
        [0, 0, 0, c24, c25, c26],
        [0, 0, 0, c34, c35, c36],
        [-c14, -c24, -c34, 0, Lz, -Ly],
        [-c15, -c25, -c35, -Lz, 0, Lx],
        [-c16, -c26, -c36, Ly, -Lx, 0],
    ]
