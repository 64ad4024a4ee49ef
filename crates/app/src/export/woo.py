"""Element test of exported bonds in Woo: six strains of the periodic cell, nodes relaxed, stiffness in Pa (Voigt).

woo -n -x element_test.py; measured.csv must be expected.csv.

Bonds are contacts that neither slip nor break, with the stiffnesses of bonds.txt and no force at their exported length. All
spheres are given one small radius here: the point of contact is then the middle of each bond, as it is for anisobond; the
radius plays no other part. The collider runs once; what it finds that is no bond keeps no stiffness. Masses are such that
every node moves at the same pace, since only the state at rest counts.
"""

import numpy as np
import woo
from woo.core import Scene
from woo.dem import *

STRAIN, BALANCE, DAMPING, STEP, LOADING = 3e-5, 1e-7, 0.3, 0.7, 10

edges = np.loadtxt("cell.txt")
places = np.loadtxt("spheres.txt", ndmin=2)[:, :3]  # x y z radius
bonds = np.loadtxt("bonds.txt", ndmin=2)  # a b k_n k_t
ends, normal, tangential = bonds[:, :2].astype(int), bonds[:, 2], bonds[:, 3]
branch = places[ends[:, 1]] - places[ends[:, 0]]
branch -= edges * np.round(branch / edges)
length = np.linalg.norm(branch, axis=1)
mass, inertia = np.zeros(len(places)), np.zeros(len(places))
for end in (0, 1):
    np.add.at(mass, ends[:, end], np.maximum(normal, tangential))
    np.add.at(inertia, ends[:, end], 0.25 * tangential * length**2)

S = woo.master.scene = Scene(fields=[DemField()])
S.periodic = True
S.cell.setBox(*(float(edge) for edge in edges))
material = FrictMat(density=1.0, young=1.0, ktDivKn=1.0, tanPhi=1.0)
radius = 0.25 * float(length.min())
for place, m, i in zip(places, mass, inertia):
    particle = Sphere.make(tuple(float(x) for x in place), radius, mat=material)
    state = particle.shape.nodes[0].dem
    state.mass = float(m) if m > 0 else 1.0
    state.inertia = (float(i) if i > 0 else 1.0,) * 3
    S.dem.par.add(particle)
nodes = [particle.shape.nodes[0] for particle in S.dem.par]
# Contacts up to the longest bond: a factor of the field, or of its functors before there was one.
reach = (1 + 1e-9) * float(length.max()) / (2 * radius)
if hasattr(S.dem, "distFactor"):
    S.dem.distFactor, far = reach, {}
else:
    far = {"distFactor": reach}
law = Law2_L6Geom_FrictPhys_IdealElPl(noSlip=True, noBreak=True, iniEqlb=True)
collider = InsertionSortCollider([Bo1_Sphere_Aabb(**far)], verletDist=0.0)
contacts = ContactLoop([Cg2_Sphere_Sphere_L6Geom(**far)], [Cp2_FrictMat_FrictPhys()], [law], evalStress=True)
S.engines = [Leapfrog(damping=DAMPING, reset=True), collider, contacts]
S.dt = STEP
S.one()
collider.dead = True
stiffness = {(min(a, b), max(a, b)): (float(n), float(t)) for (a, b), n, t in zip(ends.tolist(), normal, tangential)}
for contact in S.dem.con:
    pair = (min(contact.id1, contact.id2), max(contact.id1, contact.id2))
    contact.phys.kn, contact.phys.kt = stiffness.pop(pair, (0.0, 0.0))
if stiffness:
    raise SystemExit(f"{len(stiffness)} bonds have no contact, as {next(iter(stiffness))}")


def strained(rate):
    """Strains the cell at a rate for a while, nodes with it."""
    S.cell.nextGradV = tuple(tuple(float(x) for x in row) for row in rate)
    S.run(LOADING, wait=True)
    S.cell.nextGradV = ((0.0,) * 3,) * 3


def at_rest():
    """Strain and stress (11 22 33 23 13 12, shears γ) when the nodes have come to rest."""
    force, torque = (BALANCE * STRAIN * np.mean(normal * length**power) for power in (1, 2))
    for _ in range(20000):
        S.run(50, wait=True)
        forces = max(node.dem.force.norm() for node in nodes)
        if forces < force and max(node.dem.torque.norm() for node in nodes) < torque:
            break
    else:
        raise SystemExit("the nodes did not come to rest")
    of = lambda t, share: np.array([share * (t[i, j] + t[j, i]) if i != j else t[i, j] for i, j in PAIRS])
    one = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    return of(S.cell.trsf, 1.0) - one, of(contacts.stress, 0.5)


PAIRS = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
strains, stresses = np.zeros((6, 6)), np.zeros((6, 6))
for case, (i, j) in enumerate(PAIRS):
    rate = np.zeros((3, 3))
    rate[i, j] += 0.5 * STRAIN / (LOADING * STEP)
    rate[j, i] += 0.5 * STRAIN / (LOADING * STEP)
    strained(rate)
    up = at_rest()
    strained(-2 * rate)
    down = at_rest()
    strained(rate)
    strains[:, case], stresses[:, case] = up[0] - down[0], up[1] - down[1]
# Stresses are C times the strains that the cell had.
measured = np.linalg.solve(strains.T, stresses.T).T
np.savetxt("measured.csv", measured, delimiter=",", header="11,22,33,23,13,12", comments="")
