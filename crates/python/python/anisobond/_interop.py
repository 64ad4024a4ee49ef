"""Tensors and structures of other packages, known by what they have; nothing is imported unless asked for."""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy

from ._errors import Error

#: One atomic mass unit (kg) over one cubic ångström (m³): CODATA 2018.
_DALTON_PER_CUBIC_ANGSTROM = 1.660_539_066_60e-27 / 1e-30

#: One eV/Å³ (Pa).
_EV_PER_CUBIC_ANGSTROM = 1.602_176_634e11


def recognise(thing: Any):
    """(6×6 Voigt stiffness, its usual unit) of a tensor of pymatgen or Elasticipy; None of what is of no other package.

    Only what is known to be a stiffness is taken for one, or what is known to be a compliance, which is inverted.
    """
    known = {cls.__module__.split(".")[0].lower(): None for cls in type(thing).__mro__}
    names = {cls.__name__ for cls in type(thing).__mro__}
    if "pymatgen" in known:
        if "ElasticTensor" in names:
            return numpy.asarray(thing.voigt, dtype=float), "GPa"
        if "ComplianceTensor" in names:
            # Its Voigt matrix has engineering shear strains: s44 = 1/G23.
            return _inverse(numpy.asarray(thing.voigt, dtype=float)), "GPa"
        raise Error(f"a {type(thing).__name__} of pymatgen is no stiffness; give an ElasticTensor or a ComplianceTensor")
    if "elasticipy" in known:
        # Its compliance tensors are stiffness tensors by class.
        compliance = "ComplianceTensor" in names
        if compliance or "StiffnessTensor" in names:
            for name in ("matrix", "to_Voigt"):
                matrix = getattr(thing, name, None)
                matrix = matrix() if callable(matrix) else matrix
                if matrix is not None and numpy.shape(matrix) == (6, 6):
                    matrix = numpy.asarray(matrix, dtype=float)
                    return (_inverse(matrix) if compliance else matrix), "GPa"
        raise Error("the tensor of Elasticipy is no stiffness of one material; give a StiffnessTensor of shape (6, 6)")
    return None


def _inverse(compliance: Any) -> Any:
    """The stiffness of a 6×6 Voigt compliance with engineering shear strains."""
    try:
        stiffness = numpy.linalg.inv(compliance)
    except numpy.linalg.LinAlgError:
        raise Error("the compliance cannot be inverted; check its components") from None
    return 0.5 * (stiffness + stiffness.T)


def json_text(value: Any, place: str) -> str:
    """Dictionaries, lists, numbers and texts as JSON, NumPy's among them; what is none is named by its place."""
    return json.dumps(_plain(value, place), ensure_ascii=False)


def _plain(value: Any, place: str) -> Any:
    if isinstance(value, numpy.ndarray):
        value = value.tolist()
    elif isinstance(value, numpy.generic):
        value = value.item()
    if isinstance(value, Mapping):
        return {str(key): _plain(item, f"{place}: {key}") for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item, f"{place}[{k}]") for k, item in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        raise Error(f"{place} is {value}; give a finite number")
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    if hasattr(value, "__fspath__"):
        return str(value.__fspath__())
    raise Error(f"{place} is a {type(value).__name__}; give numbers, texts, lists and dictionaries")


def suggestion(function: str, given: str, keywords: Iterable[str]) -> str:
    """The nearest keyword to one that is unknown."""
    import difflib

    import anisobond

    own = inspect.signature(getattr(anisobond, function)).parameters.values()
    known = [p.name for p in own if p.kind is not p.VAR_KEYWORD] + list(keywords)
    near = difflib.get_close_matches(given, known, n=1)
    return f"did you mean {near[0]}?" if near else f"it has {', '.join(known)}"


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
