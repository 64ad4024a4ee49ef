"""Yade on a periodic packing: time of a step of elastic bonds, and an axial element test by relaxation.

    yade -n -x -j1 verification/peers/yade_packing.py PACKING BONDS [LAW] [STEPS] [STRAIN]

PACKING: first line the edges of the periodic cell, then x y z r. BONDS: lines `a b k_n k_t` (spheres from 0, N/m), the
bonds of contact radius 1.8; Yade finds its own pairs, which must be these, and takes their stiffnesses. LAW: `cohfrict`
(Law2_ScGeom6D_CohFrictPhys_CohesionMoment without its moments) or `cpm` (Law2_ScGeom_CpmPhys_Cpm, never damaged); both
have a normal force and an incremental shear force, as our bonds. STEPS: steps that are timed (200). STRAIN: that of the
element test along z (-1e-4), no other strain; 0 leaves it out.

Prints one line of JSON: interactions; `step_s` and `step_core_s`, seconds of a step by the clock (fastest of ten parts)
and of processor time of all threads; of the element test its seconds, processor seconds, steps, the unbalanced force left
and C33 (Pa).
"""

import json
import math
import sys
import time

from yade import *
from yade import utils

ENLARGED = 1.8
PARTS = 10
MOST_STEPS = 5000
BALANCE = 1e-4


def read(path):
    lines = open(path).read().splitlines()
    cell = [float(x) for x in lines[0].replace("##PERIODIC::", "").split()[:3]]
    rows = [[float(x) for x in line.split()] for line in lines[1:]]
    return cell, [r for r in rows if len(r) == 4]


def laws(law):
    if law == "cpm":
        material = CpmMat(young=1e8, poisson=0.2, density=2500, neverDamage=True, epsCrackOnset=1, relDuctility=1e9, sigmaT=1e20, frictionAngle=0.5)
        return material, Ig2_Sphere_Sphere_ScGeom, Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=10), Law2_ScGeom_CpmPhys_Cpm()
    material = CohFrictMat(young=1e8, poisson=0.2, density=2500, isCohesive=True, momentRotationLaw=False, normalCohesion=1e20, shearCohesion=1e20)
    physics = Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(setCohesionOnNewContacts=True)
    return material, Ig2_Sphere_Sphere_ScGeom6D, physics, Law2_ScGeom6D_CohFrictPhys_CohesionMoment()


def bonded(cell, rows, law):
    """Spheres joined by Yade's own pairs at the contact radius; the engines afterwards look for no more."""
    material, geometry, physics, response = laws(law)
    O.periodic = True
    O.cell.setBox(*cell)
    O.materials.append(material)
    O.bodies.append([utils.sphere(r[:3], r[3]) for r in rows])
    boxes, pairs = Bo1_Sphere_Aabb(aabbEnlargeFactor=ENLARGED), geometry(interactionDetectionFactor=ENLARGED, avoidGranularRatcheting=False)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([boxes]),
        InteractionLoop([pairs], [physics], [response]),
        NewtonIntegrator(damping=0.0),
    ]
    O.dt = 1e-9
    O.step()
    boxes.aabbEnlargeFactor = pairs.interactionDetectionFactor = 1.0


def stiffen(law, bonds):
    """Give Yade's pairs the stiffnesses of ours; both lists must be the same."""
    stiff = {}
    for line in open(bonds):
        a, b, kn, kt = line.split()
        stiff[tuple(sorted((int(a), int(b))))] = (float(kn), float(kt))
    for i in O.interactions:
        kn, kt = stiff.pop(tuple(sorted((i.id1, i.id2))))
        if law == "cpm":
            scale = i.phys.refLength / i.phys.crossSection
            i.phys.E, i.phys.G = kn * scale, kt * scale
        else:
            i.phys.kn, i.phys.ks, i.phys.unp = kn, kt, i.geom.penetrationDepth
    if stiff:
        raise SystemExit(f"{len(stiff)} of our bonds are none of Yade's")


def stable_step(bonds):
    """A step below the stable one: of every sphere the sum of its bonds' k_n + k_t over its mass."""
    sums = [0.0] * len(O.bodies)
    for line in open(bonds):
        a, b, kn, kt = line.split()
        for i in (int(a), int(b)):
            sums[i] += float(kn) + float(kt)
    return 0.8 * math.sqrt(min(b.state.mass / s for b, s in zip(O.bodies, sums)))


def timed(steps):
    each = max(steps // PARTS, 1)
    clock, core = math.inf, time.process_time()
    for _ in range(PARTS):
        start = time.perf_counter()
        O.run(each, True)
        clock = min(clock, time.perf_counter() - start)
    return {"step_s": clock / each, "step_core_s": (time.process_time() - core) / (PARTS * each)}


def element_test(strain):
    """Strain along z and no other; relaxed by Cundall's damping until forces balance."""
    O.engines[3].damping = 0.4
    steps, clock, core = 10, time.perf_counter(), time.process_time()
    O.cell.velGrad = Matrix3(0, 0, 0, 0, 0, 0, 0, 0, strain / (steps * O.dt))
    O.run(steps, True)
    O.cell.velGrad = Matrix3.Zero
    while steps < MOST_STEPS and utils.unbalancedForce() > BALANCE:
        O.run(10, True)
        steps += 10
    seconds, core = time.perf_counter() - clock, time.process_time() - core
    stiffness = utils.getStress()[2, 2] / strain
    return {"test_s": seconds, "test_core_s": core, "test_steps": steps, "unbalanced": utils.unbalancedForce(), "C33_Pa": stiffness}


def main():
    path, bonds = sys.argv[1], sys.argv[2]
    law = sys.argv[3] if len(sys.argv) > 3 else "cohfrict"
    steps = int(sys.argv[4]) if len(sys.argv) > 4 else 200
    strain = float(sys.argv[5]) if len(sys.argv) > 5 else -1e-4
    cell, rows = read(path)
    bonded(cell, rows, law)
    stiffen(law, bonds)
    O.dt = stable_step(bonds)
    answer = {"law": law, "threads": O.numThreads, "interactions": O.interactions.countReal()}
    answer.update(timed(steps))
    if strain:
        answer.update(element_test(strain))
    print("yade " + json.dumps(answer), flush=True)


main()
