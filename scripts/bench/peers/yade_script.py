"""Run by YADE's own Python in a folder with `box.json` and `discs.txt` (x, y, radius, mass, velocity); writes `discs.out`."""

import json
import time
from math import atan

import numpy as np
from yade import (
    Bo1_Sphere_Aabb,
    CohFrictMat,
    ForceResetter,
    FrictMat,
    Ig2_Sphere_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom6D,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_CohFrictMat_CohFrictMat_CohFrictPhys,
    Ip2_FrictMat_FrictMat_FrictPhys,
    Law2_ScGeom6D_CohFrictPhys_CohesionMoment,
    Law2_ScGeom_FrictPhys_CundallStrack,
    NewtonIntegrator,
    O,
    utils,
)

with open("box.json") as file:
    box = json.load(file)
discs = np.loadtxt("discs.txt")
angle, ratio = atan(box["friction"]), box["shear"] / box["normal"]
for k, (x, y, radius, mass, u, v) in enumerate(discs):
    # E r is the same for all discs, and so is the stiffness of all contacts, 2 Ea ra Eb rb / (Ea ra + Eb rb)
    young = {"young": box["normal"] / radius, "poisson": ratio, "frictionAngle": angle}
    if box["bonded"]:
        strong = box["strength"] / radius**2
        material = CohFrictMat(isCohesive=True, momentRotationLaw=False, normalCohesion=strong, shearCohesion=strong, **young)
    else:
        material = FrictMat(**young)
    held = k < box["held"]
    body = utils.sphere((x, y, 0.0), radius, material=material, fixed=held, mask=3 if held else 1)
    body.state.mass = mass
    body.state.inertia = (0.5 * mass * radius**2,) * 3
    body.state.blockedDOFs = "xyzXYZ" if held else "zXY"
    body.state.vel = (u, v, 0.0)
    O.bodies.append(body)

collider = InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=box["margin"] * discs[:, 2].min(), avoidSelfInteractionMask=2)
if box["bonded"]:
    loop = InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom6D()],
        [Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(setCohesionNow=True, setCohesionOnNewContacts=False)],
        [Law2_ScGeom6D_CohFrictPhys_CohesionMoment()],
    )
else:
    loop = InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]
    )
O.engines = [ForceResetter(), collider, loop, NewtonIntegrator(damping=box["damping"], gravity=(0, 0, 0))]
O.dt = box["dt"]
if box["warm_up"]:
    O.run(box["warm_up"], True)
begin = time.perf_counter()
O.run(box["steps"], True)
np.savetxt("seconds.out", [time.perf_counter() - begin])
states = [body.state for body in O.bodies]
np.savetxt("discs.out", [(s.pos[0], s.pos[1], s.vel[0], s.vel[1]) for s in states], fmt="%.17g")
