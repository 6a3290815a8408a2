"""Large strain: stress turns with its zone, and strain is measured half-way through a step.

The Jaumann rate of the stress obeys the law. With w = (d(dv)/dx - d(du)/dy)/2 the spin of a step, sd = (xx - yy)/2:

    d sd = -2 w xy,    d xy = 2 w sd                 besides what strain adds

A step of finite size turns a triangle by the angle a with tan(a/2) = w/2, if w is that of the shape at mid-step (Hughes & Winget
1980): exactly the angle of a rigid turn, whose strain is zero then. The stress is turned by half of it, loaded with the step's
strain, which belongs to the middle of the step, and turned by the other half: second order in the step. In (sd, xy) a
turn by a/2 is one by a,

    cos a = (1 - q^2)/(1 + q^2),    sin a = 2 q/(1 + q^2),    q = w/2.

Source: Hughes, T. J. R. & Winget, J. (1980), Int. J. Numer. Methods Eng. 15, 1862-1867.
"""


def half_turn(q):
    """cos a and sin a of the turn of (sd, xy) by half a step; q = w/2 [-]."""
    inverse = 1.0 / (1.0 + q * q)
    return (1.0 - q * q) * inverse, 2.0 * q * inverse


def turned(sd, xy, cosine, sine):
    """sd and xy [Pa] after half a turn."""
    return cosine * sd - sine * xy, sine * sd + cosine * xy
