#!/usr/bin/env python3
"""How bonds near a free face may be calibrated: rules compared on a slab of N layers, periodic in its plane.

    pip install numpy scipy && python verification/surface_rules.py

Isotropic material of Poisson's ratio 1/4 (C11 = 3, C12 = C44 = 1), horizon 3 spacings, influence delta/r. Every rule gives one
micromodulus per bond. A bond pulls its ends with k = omega c / l times its stretch; with the spacing as the unit,
a node's share of the stiffness is sum (1/2) omega l c n n n n, and the force on it in a homogeneous strain E is
M : E with M = sum omega c n n n. In a slab that is in equilibrium under tractions, M is 0 in all layers but the outermost,
where it is -C.N.

Rules:
  off         the bulk's values
  each end    a node's bonds reach C by themselves, a bond takes the mean of its ends (what `surface_calibration` does)
  mean        the means of both ends reach C at every node
  faces       M is that of equilibrium at every node, and what of C lies in the plane is reached at every node; only bonds with
              a cut-off end change
  half cell   the same, with the half cell outside the outermost nodes free of stress across the plane
"""

import itertools
from math import factorial

import numpy as np
from scipy.optimize import lsq_linear

M = 3
OFFSETS = [o for o in itertools.product(range(-M, M + 1), repeat=3) if 0 < sum(x * x for x in o) <= M * M]
XI = np.array(OFFSETS, float)
LENGTH = np.linalg.norm(XI, axis=1)
NORMAL = XI / LENGTH[:, None]
OMEGA = M / LENGTH
INDEX = {o: i for i, o in enumerate(OFFSETS)}
OPPOSITE = [INDEX[tuple(-x for x in o)] for o in OFFSETS]


def components(order):
    """Components of a symmetric tensor, each with the root of its number of permutations."""
    names = list(itertools.combinations_with_replacement(range(3), order))
    return names, [np.sqrt(factorial(order) / np.prod([factorial(n.count(i)) for i in range(3)])) for n in names]


FOURTH, WEIGHT4 = components(4)
THIRD, WEIGHT3 = components(3)


def c(a, b, i, j):
    return float((a == b) * (i == j) + (a == i) * (b == j) + (a == j) * (b == i))


def form(names, weights):
    return np.array([np.prod(NORMAL[:, list(n)], axis=1) * w for n, w in zip(names, weights)])


TARGET = np.array([c(*n) * w for n, w in zip(FOURTH, WEIGHT4)])
STIFFNESS = form(FOURTH, WEIGHT4) * (0.5 * OMEGA * LENGTH)
FORCE = np.array([np.prod(NORMAL[:, list(n)], axis=1) for n in THIRD]) * OMEGA
BULK = STIFFNESS.T @ np.linalg.solve(STIFFNESS @ STIFFNESS.T, TARGET)


class Slab:
    def __init__(self, layers):
        self.layers = layers

    def bonds(self, z):
        return [b for b in range(len(OFFSETS)) if 0 <= z + OFFSETS[b][2] < self.layers]

    def each_end(self):
        values = []
        for z in range(self.layers):
            here = self.bonds(z)
            x = STIFFNESS[:, here]
            softness = 1e-3 * ((0.5 * OMEGA * LENGTH)[here] ** 2).sum() / 15
            y = np.linalg.solve(x @ x.T + softness * np.eye(15), TARGET - x @ BULK[here])
            own = np.zeros(len(OFFSETS))
            own[here] = np.clip(BULK[here] + x.T @ y, 0, 4 * BULK.max())
            values.append(own)
        pairs = ((z, b) for z in range(self.layers) for b in self.bonds(z))
        return {(z, b): 0.5 * (values[z][b] + values[z + OFFSETS[b][2]][OPPOSITE[b]]) for z, b in pairs}

    def least_change(self, conditions, everywhere):
        """Least change of the bulk's values that meets (row over a node's bonds, value) in every layer."""
        cut = lambda z: z < M or z >= self.layers - M
        free = lambda z, b: everywhere or cut(z) or cut(z + OFFSETS[b][2])
        half = [(z, b) for z in range(self.layers) for b in self.bonds(z) if OFFSETS[b][::-1] > (0, 0, 0) and free(z, b)]
        number = {}
        for i, (z, b) in enumerate(half):
            number[(z, b)] = number[(z + OFFSETS[b][2], OPPOSITE[b])] = i
        rows, right = [], []
        for z in range(self.layers):
            for vector, value in conditions(z):
                row = np.zeros(len(half))
                for b in self.bonds(z):
                    if (z, b) in number:
                        row[number[(z, b)]] += vector[b]
                    else:
                        value = value - vector[b] * BULK[b]
                rows.append(row)
                right.append(value)
        a, r, start = np.array(rows), np.array(right), np.array([BULK[b] for _, b in half])
        stacked = np.vstack([np.eye(len(half)), 1e4 * a])
        k = lsq_linear(stacked, np.concatenate([start, 1e4 * r]), bounds=(0, 4 * BULK.max()), tol=1e-12).x
        values = {(z, b): BULK[b] for z in range(self.layers) for b in self.bonds(z)}
        values.update({key: k[i] for key, i in number.items()})
        return values

    def reach(self, _):
        return list(zip(STIFFNESS, TARGET))

    def faces(self, half_cell):
        def conditions(z):
            outward = (z == self.layers - 1) - (z == 0)
            rows = [(FORCE[q], -c(*n, 2) * outward) for q, n in enumerate(THIRD)]
            for q, n in enumerate(FOURTH):
                if 2 in n:
                    continue
                orders = [(0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2)]
                relaxed = lambda i, j, k, l: c(i, j, 2, 2) * c(2, 2, k, l) / c(2, 2, 2, 2)
                share = 0.5 * half_cell * abs(outward)
                value = np.mean([c(*(n[i] for i in o)) - share * relaxed(*(n[i] for i in o)) for o in orders])
                rows.append((STIFFNESS[q], value * WEIGHT4[q]))
            return rows

        return conditions


def measured(slab, values):
    """Membrane stiffness, contraction of the whole thickness and of its middle, bending stiffness, each over the exact one less 1;
    largest force on a layer, over the stress, in the exact strain of uniaxial tension with lateral strain held."""
    n, mid = slab.layers, slab.layers // 2
    k = np.zeros((n, n))
    pull, bend = np.zeros(n), np.zeros(n)
    membrane = bending = 0.0
    force = np.zeros(n)
    for (z, b), value in values.items():
        stiffness, (nx, _, nz), other = OMEGA[b] * value / LENGTH[b], NORMAL[b], z + OFFSETS[b][2]
        at = 0.5 * (z + other) - (n - 1) / 2
        k[z, z] += stiffness * nz * nz
        k[z, other] -= stiffness * nz * nz
        pull[z] += stiffness * nz * nx * nx * LENGTH[b]
        bend[z] += stiffness * nz * nx * nx * LENGTH[b] * at
        membrane += 0.5 * stiffness * nx**4 * LENGTH[b] ** 2
        bending += 0.5 * stiffness * nx**4 * LENGTH[b] ** 2 * at * at
        if z + 1 < n and z > 0:
            force[z] += stiffness * nz * (nx * nx - nz * nz / 3) * LENGTH[b]
    u = np.linalg.lstsq(k, pull, rcond=None)[0]
    bent = np.linalg.lstsq(k, bend, rcond=None)[0]
    exact = 3 - 1 / 3
    whole = -3 * (u[-1] - u[0]) / (n - 1) - 1
    middle = -3 * (u[mid + 1] - u[mid - 2]) / 3 - 1
    return [
        (membrane - pull @ u) / (exact * n) - 1,
        whole,
        middle,
        (bending - bend @ bent) / (exact * n**3 / 12) - 1,
        np.abs(force).max() / exact,
    ]


print("rule        layers  membrane  contraction  in the middle   bending   force/stress  largest c")
for layers in [8, 16, 32]:
    slab = Slab(layers)
    rules = {
        "off": {(z, b): BULK[b] for z in range(layers) for b in slab.bonds(z)},
        "each end": slab.each_end(),
        "mean": slab.least_change(slab.reach, True),
        "faces": slab.least_change(slab.faces(0), False),
        "half cell": slab.least_change(slab.faces(1), False),
    }
    for name, values in rules.items():
        m = measured(slab, values)
        most = max(values.values()) / BULK.max()
        print(f"{name:10} {layers:6}   {m[0]:+.1e}     {m[1]:+.1e}       {m[2]:+.1e}  {m[3]:+.1e}        {m[4]:.1e}       {most:.2f}")
