"""Nodal mixed discretisation: volumetric strain is averaged at gridpoints, over the zones around them.

    gridpoint n    e_n = sum w A e / sum w A     over the corners of zones that belong to n                      (1)
    of a zone      E = sum w e_n                 over its corners, w: 1/4, in a triangular zone 1/3              (2)

e is the volumetric strain increment of a zone of area A. E takes its place in the elastic law; the deviator remains that of each
triangle. The changes of sm and zz by the laws after elasticity are averaged in the same way: without this, dilatant
flow diverges. Corners are averaged together as in coupler_protocol.geometry.corner_joints: within one material, not over removed
zones.

With M for (1) and (2), E = M e. A M = A W^T D^-1 W A is symmetric, not negative, and at most A: forces are those of an elastic
energy, and a step that is stable without M is stable with M. Strains of alternate signs give no stress: M e = 0, so the pressure
mode of quadrilaterals (docs/theory.md) is not excited.

Source: Detournay, C. & Dzik, E. (2006), Nodal mixed discretization for tetrahedral elements, 4th Int. FLAC Symposium, Madrid.
There e is that of tetrahedra; here it is that of zones whose triangles already share one volumetric strain.
"""

NODAL = "nodal"


def parameters(grid):
    """True if a scene's table [grid] has mixed = "nodal", else None."""
    return True if grid.mixed == NODAL else None
