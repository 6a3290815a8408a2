"""Large strain: stress rotates with its zone, and strain is measured at mid-step.

The Jaumann rate of the stress obeys the law. With w = (d(dv)/dx - d(du)/dy)/2 the spin of a step, sd = (xx - yy)/2:

    d sd = -2 w xy,    d xy = 2 w sd                 in addition to the increments by strain

A step of finite size rotates a triangle by the angle a with tan(a/2) = w/2, if w is that of the shape at mid-step (Hughes &
Winget 1980). For a rigid rotation this is the exact angle, with zero strain. The stress is rotated by a/2, loaded with the step's
strain, which belongs to the middle of the step, and rotated by a/2 again: second order in the step. In (sd, xy) a rotation by a/2
has the angle a,

    cos a = (1 - q^2)/(1 + q^2),    sin a = 2 q/(1 + q^2),    q = w/2.

Source: Hughes, T. J. R. & Winget, J. (1980), Int. J. Numer. Methods Eng. 15, 1862-1867.
"""


def half_turn(q):
    """cos a and sin a of the rotation of (sd, xy) by half a step; q = w/2 [-]."""
    inverse = 1.0 / (1.0 + q * q)
    return (1.0 - q * q) * inverse, 2.0 * q * inverse


def turned(sd, xy, cosine, sine):
    """sd and xy [Pa] after the rotation by half a step."""
    return cosine * sd - sine * xy, sine * sd + cosine * xy
