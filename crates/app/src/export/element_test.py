"""Element test from MatrixMarket files: C = (A - F^T K^+ F) / V, in Pa (Voigt), as measured.csv.

Needs numpy and scipy. measured.csv must be expected.csv to the solver's tolerance.
"""

import numpy as np
from scipy.io import mmread
from scipy.sparse.linalg import LinearOperator, cg

K = mmread("stiffness.mtx").tocsr()
F, A = mmread("forces.mtx"), mmread("uniform.mtx")
V = float(open("volume.txt").read())
D = K.diagonal()
precondition = LinearOperator(K.shape, lambda x: x / np.where(D > 0, D, 1.0))
C = A.copy()
smallest = 1e-12 * np.sqrt(A.max() * D.max())
for case in range(6):
    f = F[:, case]
    if np.abs(f).max() <= smallest:
        continue  # no force on any node: a perfect grid
    x, failed = cg(K, f, rtol=1e-12, maxiter=20000, M=precondition)
    if failed:
        raise SystemExit("the solver did not converge")
    C[:, case] -= F.T @ x
C /= V
np.savetxt("measured.csv", 0.5 * (C + C.T), delimiter=",", header="11,22,33,23,13,12", comments="")
