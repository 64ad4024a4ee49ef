"""Stiffness of the strained blocks, in Pa (Voigt): python measure.py; measured.csv must be expected.csv.

Reads the forces of the nodes from the engine's files strain_11.e … strain_12.e (Exodus, of one process). The stress is
-(1/V) Σ F⊗x: all displacements are prescribed, and the forces are those of the bonds. Needs NumPy, and netCDF4 or SciPy.
"""

import re

import numpy as np

STRAIN, VOLUME = {strain}, {volume}


def variables(path):
    try:
        from netCDF4 import Dataset
    except ImportError:
        from scipy.io import netcdf_file

        return netcdf_file(path, "r", mmap=False).variables
    file = Dataset(path)
    file.set_auto_mask(False)
    return file.variables


def stress(path):
    of = variables(path)
    coordinates = [of["coord" + axis][:] for axis in "xyz"] if "coordx" in of else of["coord"][:]
    x = np.array(coordinates, dtype=float).T
    names = [b"".join(row).decode().strip("\0 ") for row in np.array(of["name_nod_var"][:], dtype="S1")]
    force = np.zeros_like(x)
    for number, name in enumerate(names, 1):
        axis = re.fullmatch(r"forces?_?([xyz])", name, re.IGNORECASE)
        if axis:
            force[:, "xyz".index(axis[1].lower())] = of[f"vals_nod_var{number}"][-1]
    return -force.T @ x / VOLUME


measured = np.zeros((6, 6))
for case, name in enumerate(["11", "22", "33", "23", "13", "12"]):
    s = stress(f"strain_{name}.e") / STRAIN
    measured[:, case] = [0.5 * (s[i, j] + s[j, i]) for i, j in [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]]
np.savetxt("measured.csv", measured, delimiter=",", header="11,22,33,23,13,12", comments="")
