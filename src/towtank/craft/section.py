"""Fin sections: the NACA four-digit symmetric thickness form with a closed trailing edge."""

from __future__ import annotations

import numpy as np

from towtank.frames import Array

_POWERS = (0.29690, -0.12600, -0.35160, 0.28430, -0.10360)


def half_thickness(thickness: float, xi: Array | float) -> Array:
    """Half thickness over the chord at the fractions ``xi`` (any shape, 0 leading edge to 1 trailing edge).

    ``thickness`` is the thickness-to-chord ratio of the section.

    Source     abbott1959, section 6.4, thickness distribution of the four-digit sections.
    Departure  The last coefficient is -0.1036 for -0.1015, so that the trailing edge closes. groves1989 closes it
               with 0.2852 and -0.1045: 1e-4 of the chord apart at most.
    """
    a, b, c, d, e = _POWERS
    xi = np.clip(np.asarray(xi, dtype=float), 0.0, 1.0)
    form = a * np.sqrt(xi) + xi * (b + xi * (c + xi * (d + xi * e)))
    return np.asarray(5.0 * thickness * np.clip(form, 0.0, None))


def cosine_fractions(count: int) -> Array:
    """``count`` chord fractions from 0 to 1, dense at both ends (where the section curves)."""
    return np.asarray(0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count))))
