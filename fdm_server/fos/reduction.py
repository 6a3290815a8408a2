"""Shear strength divided by a factor F (Zienkiewicz, Humpheson & Lewis 1975, Geotechnique 25):

    c_F = c/F        tan(phi_F) = tan(phi)/F

Two rules belong to it, and a result has no meaning without them:

- dilation: flow with psi > phi creates energy. "kept": psi_F = min(psi, phi_F), it stays until the reduced friction reaches it
  (Tschuchnigg, Schweiger & Sloan 2015, Comput. Geotech. 70). "reduced": tan(psi_F) = tan(psi)/F. Associated flow, psi = phi,
  stays associated by both.
- tension: "kept", as the factor is defined on shear strength (Duncan 1996, J. Geotech. Eng. 122). "reduced": t_F = t/F. The
  apex c_F/tan(phi_F) = c/tan(phi) does not move, and the cut-off is never beyond it.
"""

from math import atan, degrees, radians, tan

from fdm_server.effects.softening import curves

DILATION = {
    "kept": "psi stays until the reduced friction angle reaches it: psi_F = min(psi, phi_F)",
    "reduced": "tan(psi_F) = tan(psi)/F",
}
TENSION = {
    "kept": "tensile strength stays (the apex c/tan(phi) does not depend on F)",
    "reduced": "tensile strength is divided by F",
}


def rules(table):
    """Texts of the rules for a [fos] table."""
    if table.by == "gravity":
        return {"gravity": "g_F = F g, reached gradually; strength stays"}
    return {
        "strength": "c_F = c/F, tan(phi_F) = tan(phi)/F",
        "dilation": DILATION[table.dilation],
        "tension": TENSION[table.tension],
    }


def reduced(materials, factor, table):
    """Materials of a scene with their strength divided by `factor`, by the rules of a [fos] table."""
    return [_reduced(material, factor, table) for material in materials]


def _reduced(material, factor, table):
    change = {}
    if material.mohr_coulomb is not None:
        law = material.mohr_coulomb
        phi = _divided(law.friction, factor)
        psi = min(law.dilation, phi) if table.dilation == "kept" else _divided(law.dilation, factor)
        change["mohr_coulomb"] = law.model_copy(update={"friction": phi, "cohesion": law.cohesion / factor, "dilation": psi})
    if material.tension is not None and table.tension == "reduced":
        strength = material.tension.strength / factor
        change["tension"] = material.tension.model_copy(update={"strength": strength})
    if material.softening is not None:
        change["softening"] = _reduced_curves(material, factor, table)
    return material.model_copy(update=change)


def _reduced_curves(material, factor, table):
    """Softening with every point of its curves divided by the same rules."""
    law, values = material.softening, curves(material.softening, material.mohr_coulomb, material.tension)
    phi = [_divided(angle, factor) for angle in values["friction"][1:]]
    psi = values["dilation"][1:]
    psi = list(map(min, psi, phi)) if table.dilation == "kept" else [_divided(angle, factor) for angle in psi]
    change = {"friction": phi, "dilation": psi, "cohesion": [c / factor for c in values["cohesion"][1:]]}
    if law.tension is not None and table.tension == "reduced":
        change["tension"] = [t / factor for t in law.tension]
    return law.model_copy(update=change)


def _divided(angle, factor):
    """Angle [deg] whose tangent is 1/factor of that of `angle`."""
    return degrees(atan(tan(radians(angle)) / factor))
