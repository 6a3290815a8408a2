"""Flow rule of a search: the dilation angles psi of the scene, psi = 0 in all materials, or associated flow, psi = phi.

The factor divides strength; flow decides how much of the strength a mechanism that is not free to dilate mobilises. Published
factors belong to one rule or the other (docs/theory.md, "Factors of safety"), so a search names its rule.
"""

from fdm_server.effects.softening import curves

SCENE, ZERO, ASSOCIATED = "scene", "zero", "associated"


def with_flow(scene):
    """The scene with the dilation angles that `fos.flow` asks for."""
    if scene.fos.flow == SCENE:
        return scene
    return scene.model_copy(update={"material": [_flowing(m, scene.fos.flow) for m in scene.material]})


def _flowing(material, flow):
    law, soft = material.mohr_coulomb, material.softening
    if law is None:
        return material
    change = {"mohr_coulomb": law.model_copy(update={"dilation": law.friction if flow == ASSOCIATED else 0.0})}
    if soft is not None:
        psi = curves(soft, law, None)["friction"][1:] if flow == ASSOCIATED else [0.0] * len(soft.strain)
        change["softening"] = soft.model_copy(update={"dilation": psi})
    return material.model_copy(update=change)


def in_words(scene):
    """The flow rule of a scene's materials, in words."""
    said = {m.name: _rule(m) for m in with_flow(scene).material if m.mohr_coulomb is not None}
    if len(set(said.values())) == 1:
        return f"{next(iter(said.values()))} in all materials" if len(said) > 1 else next(iter(said.values()))
    return ", ".join(f"{rule} in {name!r}" for name, rule in said.items())


def _rule(material):
    values = curves(material.softening, material.mohr_coulomb, None)
    phi, psi = values["friction"], values["dilation"]
    if not any(psi):
        return "psi = 0 (non-associated)" if any(phi) else "psi = phi = 0"
    if psi == phi:
        return "psi = phi (associated)"
    changes = ", changing with plastic strain" if len({*psi}) > 1 else ""
    return f"psi = {psi[0]:g} of phi = {phi[0]:g} deg{changes} (non-associated)"
