"""Tensors and structures of other packages, known by what they have; nothing is imported unless asked for."""

from __future__ import annotations

from typing import Any

import numpy

from ._errors import Error

#: One atomic mass unit (kg) over one cubic ångström (m³): CODATA 2018.
_DALTON_PER_CUBIC_ANGSTROM = 1.660_539_066_60e-27 / 1e-30

#: One eV/Å³ (Pa).
_EV_PER_CUBIC_ANGSTROM = 1.602_176_634e11


def recognise(thing: Any):
    """(6×6 Voigt matrix, its usual unit) of a tensor of pymatgen or Elasticipy; None of anything else."""
    package = type(thing).__module__.split(".")[0].lower()
    if package == "pymatgen" and hasattr(thing, "voigt"):
        return numpy.asarray(thing.voigt, dtype=float), "GPa"
    if package == "elasticipy":
        for name in ("matrix", "to_Voigt"):
            matrix = getattr(thing, name, None)
            matrix = matrix() if callable(matrix) else matrix
            if matrix is not None and numpy.shape(matrix) == (6, 6):
                return numpy.asarray(matrix, dtype=float), "GPa"
        raise Error("the tensor of Elasticipy is no stiffness of one material; give a StiffnessTensor of shape (6, 6)")
    return None


def density(structure: Any) -> float:
    """Density (kg/m³) of a structure of pymatgen (its `density`, g/cm³) or ASE (masses over volume)."""
    if hasattr(structure, "get_masses") and hasattr(structure, "get_volume"):
        return float(structure.get_masses().sum() / structure.get_volume()) * _DALTON_PER_CUBIC_ANGSTROM
    if hasattr(structure, "density"):
        return 1e3 * float(structure.density)
    raise Error("the structure is neither of pymatgen nor of ASE; give one, or give the density to Stiffness")


def to_pymatgen(stiffness: Any) -> Any:
    """A pymatgen ElasticTensor (GPa)."""
    try:
        from pymatgen.analysis.elasticity.elastic import ElasticTensor
    except ImportError as error:
        raise ImportError("to_pymatgen needs pymatgen; pip install pymatgen") from error
    return ElasticTensor(stiffness.full / 1e9)


def to_elasticipy(stiffness: Any) -> Any:
    """An Elasticipy StiffnessTensor (GPa)."""
    try:
        from elasticipy.tensors.elasticity import StiffnessTensor
    except ImportError as error:
        raise ImportError("to_elasticipy needs elasticipy; pip install elasticipy") from error
    return StiffnessTensor(stiffness.voigt / 1e9)


def to_ase(stiffness: Any) -> Any:
    """A 6×6 matrix, order xx yy zz yz xz xy, in eV/Å³."""
    return stiffness.voigt / _EV_PER_CUBIC_ANGSTROM
