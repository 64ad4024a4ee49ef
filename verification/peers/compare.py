"""Moduli of the built-in materials by other codes, side by side with ours.

    python3 -m venv peers && peers/bin/pip install elasticipy pymatgen mechelastic
    peers/bin/python verification/peers/compare.py --write       # peers' values -> reference.json
    peers/bin/python verification/peers/compare.py [ANISOBOND]   # table of differences with the binary's answers

mechelastic carries ELATE's code (Gaillac & Coudert, MIT), which is not published as a package by itself. Stiffnesses in GPa, density
DENSITY in g/cm3, speeds in km/s.
"""

import contextlib
import importlib.metadata
import io
import json
import pathlib
import subprocess
import sys

import numpy as np

HERE = pathlib.Path(__file__).parent
DENSITY = 5.0
UPPER = {  # upper triangles, GPa
    "KIO3": [43, 11, 13, 1, -2, 2, 35, 12, 3, -1, 3, 43, 2, -2, 1, 13, 0, 0, 13, 1, 12],
    "CoTeO4": [135, 19, 54, 0, 0, 42, 13, 15, 0, 0, 6, 269, 0, 0, 18, 14, 25, 0, 66, 0, 18],
    "Te2W": [143, 1, 37, 0, 0, 0, 3, 3, 0, 0, 0, 102, 0, 0, 0, 2, 0, 0, 46, 0, 1],
    "Ta2C": [464, 159, 141, -45, 0, 0, 464, 141, 45, 0, 0, 493, 0, 0, 0, 125, 0, 0, 125, -45, 153],
    "Si": [212, 70, 58, 0, 0, 0, 212, 58, 0, 0, 0, 179, 0, 0, 0, 58, 0, 0, 58, 0, 85],
    "MoN": [499, 177, 235, 0, 0, 0, 499, 235, 0, 0, 0, 714, 0, 0, 0, 241, 0, 0, 241, 0, 161],
    "Spinel": [252, 145, 145, 0, 0, 0, 252, 145, 0, 0, 0, 252, 0, 0, 0, 142, 0, 0, 142, 0, 142],
    "Pyroceram": [103.2, 34.4, 34.4, 0, 0, 0, 103.2, 34.4, 0, 0, 0, 103.2, 0, 0, 0, 34.4, 0, 0, 34.4, 0, 34.4],
}


def voigt(name):
    c = np.zeros((6, 6))
    c[np.triu_indices(6)] = UPPER[name]
    return c + np.triu(c, 1).T


def elasticipy(c):
    from elasticipy.tensors.elasticity import StiffnessTensor

    t = StiffnessTensor(c)
    out = {"universal_anisotropy": t.universal_anisotropy}
    for key, f in [
        ("young", t.Young_modulus),
        ("shear", t.shear_modulus),
        ("poisson", t.Poisson_ratio),
        ("linear_compressibility", t.linear_compressibility),
        *zip(("wave_fast", "wave_intermediate", "wave_slow"), t.wave_velocity(DENSITY)),
    ]:
        out[key + "_min"], out[key + "_max"] = float(f.min()[0]), float(f.max()[0])
    for kind in ("voigt", "reuss", "hill"):
        average = t.average(kind.capitalize())
        out[kind + "_bulk"] = average.bulk_modulus
        out[kind + "_shear"] = average.C44
    out["is_isotropic"], out["is_cubic"] = bool(t.is_isotropic()), bool(t.is_cubic())
    out["is_tetragonal"] = bool(t.is_tetragonal())
    return out


def pymatgen(c):
    from pymatgen.analysis.elasticity.elastic import ElasticTensor

    t = ElasticTensor.from_voigt(c)
    return {
        "voigt_bulk": t.k_voigt,
        "voigt_shear": t.g_voigt,
        "reuss_bulk": t.k_reuss,
        "reuss_shear": t.g_reuss,
        "hill_bulk": t.k_vrh,
        "hill_shear": t.g_vrh,
        "hill_young": t.y_mod / 1e9,
        "hill_poisson": t.homogeneous_poisson,
        "universal_anisotropy": t.universal_anisotropy,
        "nu12": t.directional_poisson_ratio([1, 0, 0], [0, 1, 0]),
        "nu31": t.directional_poisson_ratio([0, 0, 1], [1, 0, 0]),
    }


def elate(c):
    from mechelastic.core.elate import ELATE

    with contextlib.redirect_stdout(io.StringIO()):
        t = ELATE(c.tolist()).to_dict()
    out = {}
    for ours, theirs in [
        ("young", "youngs"),
        ("shear", "shear"),
        ("poisson", "poisson"),
        ("linear_compressibility", "linearCompression"),
    ]:
        # ELATE's linear compressibility is in 1/TPa.
        unit = 1e-3 if ours == "linear_compressibility" else 1.0
        out[ours + "_min"], out[ours + "_max"] = t[theirs + "_min"] * unit, t[theirs + "_max"] * unit
    for kind in ("voigt", "reuss", "hill"):
        out[kind + "_bulk"], out[kind + "_shear"] = t[f"bulk_modulus_{kind}"], t[f"shear_modulus_{kind}"]
    out["hill_young"], out["hill_poisson"] = t["youngs_modulus_hill"], t["poisson_modulus_hill"]
    return out


def ours(analysis):
    """The same names from the JSON of `anisobond tensor MATERIAL --json` (SI there)."""
    averages, directional = analysis["moduli"], analysis["directional"]
    out = {"universal_anisotropy": averages["universal_anisotropy"], "hill_poisson": averages["hill_poisson"]}
    out["hill_young"] = averages["hill_young"] / 1e9
    for kind in ("voigt", "reuss", "hill"):
        for modulus in ("bulk", "shear"):
            out[f"{kind}_{modulus}"] = averages[kind][modulus] / 1e9
    for key, unit in [("young", 1e9), ("shear", 1e9), ("poisson", 1.0), ("linear_compressibility", 1e-9)]:
        for end in ("min", "max"):
            out[f"{key}_{end}"] = directional[key][end]["value"] / unit
    out["nu12"], out["nu31"] = (analysis["engineering"][k] for k in ("nu12", "nu31"))
    for key, extremes in analysis["waves"]["extremes"].items():
        for end in ("min", "max"):
            out[f"wave_{key}_{end}"] = extremes[end]["value"] / 1e3
    return out


PEERS = {"elasticipy": elasticipy, "pymatgen": pymatgen, "elate": elate}
PACKAGES = {"elasticipy": "elasticipy", "pymatgen": "pymatgen", "elate": "mechelastic"}


def write():
    reference = {
        "versions": {peer: f"{name} {importlib.metadata.version(name)}" for peer, name in PACKAGES.items()},
        "units": "GPa, 1/GPa, km/s",
        "density_g_per_cm3": DENSITY,
        "materials": {
            name: {"voigt": voigt(name).tolist(), **{peer: f(voigt(name)) for peer, f in PEERS.items()}}
            for name in UPPER
        },
    }
    text = json.dumps(reference, indent=1, default=float)
    (HERE / "reference.json").write_text(text + "\n")


def table(binary):
    reference = json.loads((HERE / "reference.json").read_text())
    print(f"{'material':10} {'quantity':28} {'peer':11} {'theirs':>16} {'ours':>16} {'difference':>11}")
    for name, peers in reference["materials"].items():
        answer = subprocess.run([binary, "tensor", name, "--density", f"{DENSITY} g/cm3", "--json"], capture_output=True, text=True, check=True)
        mine = ours(json.loads(answer.stdout))
        for peer in PEERS:
            for key, theirs in peers[peer].items():
                if key in mine:
                    difference = (theirs - mine[key]) / max(abs(mine[key]), 1e-3)
                    print(f"{name:10} {key:28} {peer:11} {theirs:16.9g} {mine[key]:16.9g} {difference:11.1e}")


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        write()
    else:
        table(*(sys.argv[1:] or ["anisobond"]))
