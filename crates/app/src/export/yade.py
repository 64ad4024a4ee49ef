"""Element test of exported bonds in Yade: six strains of the periodic cell, nodes relaxed, stiffness in Pa (Voigt).

yade -n -x element_test.py; measured.csv must be expected.csv. Made for Yade 2023.02a.

Bonds are cohesive contacts that never break, with the stiffnesses of bonds.txt and no force at their exported length. All
spheres are given one small radius here: the point of contact is then the middle of each bond, as it is for anisobond; the
radius plays no other part. Masses are such that every node moves at the same pace, since only the state at rest counts.
"""

import numpy as np

STRAIN, BALANCE, DAMPING, STEP = 3e-5, 1e-7, 0.3, 0.7

edges = np.loadtxt("cell.txt")
places = np.loadtxt("spheres.txt", ndmin=2)[:, :3]  # x y z radius
bonds = np.loadtxt("bonds.txt", ndmin=2)  # a b k_n k_t
ends, normal, tangential = bonds[:, :2].astype(int), bonds[:, 2], bonds[:, 3]
branch = places[ends[:, 1]] - places[ends[:, 0]]
cells = -np.round(branch / edges)
length = np.linalg.norm(branch + edges * cells, axis=1)
mass, inertia = np.zeros(len(places)), np.zeros(len(places))
for end in (0, 1):
    np.add.at(mass, ends[:, end], np.maximum(normal, tangential))
    np.add.at(inertia, ends[:, end], 0.25 * tangential * length**2)

O.periodic = True
O.cell.hSize = Matrix3(edges[0], 0, 0, 0, edges[1], 0, 0, 0, edges[2])
O.materials.append(CohFrictMat(young=1, poisson=1, density=1, frictionAngle=0, normalCohesion=1e300, shearCohesion=1e300, momentRotationLaw=False))
radius = 0.25 * length.min()
for place, m, i in zip(places, mass, inertia):
    body = O.bodies[O.bodies.append(sphere([float(x) for x in place], radius))]
    body.state.mass = m if m > 0 else 1.0
    body.state.inertia = Vector3.Ones * (i if i > 0 else 1.0)
# Without the correction against ratcheting: it scales the shear of contacts whose spheres do not touch.
geometry = Ig2_Sphere_Sphere_ScGeom6D(interactionDetectionFactor=1.01 * length.max() / (2 * radius), avoidGranularRatcheting=False)
physics = Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(setCohesionNow=True, setCohesionOnNewContacts=True)
law = Law2_ScGeom6D_CohFrictPhys_CohesionMoment(always_use_moment_law=False)
O.engines = [ForceResetter(), InteractionLoop([geometry], [physics], [law]), NewtonIntegrator(damping=DAMPING)]
O.dt = STEP
for (a, b), cell, l, k_n, k_t in zip(ends, cells, length, normal, tangential):
    contact = createInteraction(int(a), int(b))
    # The image that Yade chooses is the nearest along negative axes only.
    sign = 1 if contact.id1 == a else -1
    contact.cellDist = Vector3i(*(sign * int(c) for c in cell))
    contact.phys.kn, contact.phys.ks = float(k_n), float(k_t)
    contact.phys.normalAdhesion = contact.phys.shearAdhesion = 1e300
    contact.phys.unp = 2 * radius - float(l)


def strain(now, then):
    """Takes the cell from one strain to another, nodes with it."""
    change = np.linalg.solve(np.eye(3) + now, then - now)
    O.cell.velGrad = Matrix3(*(float(x) for x in change.flatten() / STEP))
    O.run(1, True)
    O.cell.velGrad = Matrix3.Zero


def at_rest():
    """The stress when the nodes have come to rest, their rotations too."""
    force, torque = (BALANCE * STRAIN * np.mean(normal * length**power) for power in (1, 2))
    for _ in range(20000):
        O.run(50, True)
        forces = max(O.forces.f(body.id).norm() for body in O.bodies)
        if forces < force and max(O.forces.t(body.id).norm() for body in O.bodies) < torque:
            break
    else:
        raise SystemExit("the nodes did not come to rest")
    s = getStress()
    return np.array([0.5 * (s[i, j] + s[j, i]) for i, j in PAIRS])


PAIRS = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
measured, none = np.zeros((6, 6)), np.zeros((3, 3))
for case, (i, j) in enumerate(PAIRS):
    unit = np.zeros((3, 3))
    unit[i, j] += 0.5 * STRAIN
    unit[j, i] += 0.5 * STRAIN
    strain(none, unit)
    up = at_rest()
    strain(unit, -unit)
    measured[:, case] = (up - at_rest()) / (2 * STRAIN)
    strain(-unit, none)
np.savetxt("measured.csv", measured, delimiter=",", header="11,22,33,23,13,12", comments="")
