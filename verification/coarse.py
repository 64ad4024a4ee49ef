"""How far few nodes across a dimension are off: thin strips and plates, small holes, thin plies.

    python verification/coarse.py target/release/anisobond

runs small cases and prints the tables of docs/bodies.md ("How many nodes a dimension needs").
"""

import csv
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = sys.argv[1] if len(sys.argv) > 1 else "anisobond"
E, T = 200e9, 1e6
# Central bonds reach ν = ¼ alone.
RATIO = {"central": 0.25, "hybrid": 0.35}
MODELS = [("central", True), ("central", False), ("hybrid", True), ("hybrid", False)]


def run(text, model, calibrated):
    head = f"""
name = "coarse"
material = {{ class = "isotropic", unit = "GPa", engineering = {{ e = 200, nu = {RATIO[model]} }} }}
[model]
bonds = "{model}"
surface_calibration = {str(calibrated).lower()}
[equilibrium]
tolerance = 1e-7
"""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.toml"
        case.write_text(head + text)
        out = Path(folder) / "out"
        done = subprocess.run([PROGRAM, "run", str(case), "-o", str(out)], capture_output=True, text=True)
        if done.returncode != 0:
            print(done.stderr.strip(), file=sys.stderr)
            return None
        rows = list(csv.DictReader((out / "probes.csv").open()))
    return {key: float(value) for key, value in rows[-1].items()}


def probe(name, places):
    listed = ", ".join(f'"{x}, {y}, {z} mm"' for x, y, z in places)
    return f'[[probe]]\nname = "{name}"\nquantity = "displacement"\nat = [{listed}]\n'


def layer(n, side):
    """Height of the outermost layer of n layers around 0, spacing 1."""
    return side * (n - 1) / 2


def strip(n, model, calibrated):
    """Plane strain: tension and contraction of a strip n nodes thick, and its bending; errors against E/(1−ν²), ν/(1−ν)."""
    nu = RATIO[model]
    plane_e, plane_nu = E / (1 - nu**2), nu / (1 - nu)
    length = 24 * max(n, 3)
    q = length // 4
    body = f'[body]\nbox = {{ size = "{length}, {n} mm" }}\n[grid]\nspacing = "1 mm"\nplane_strain = "z"\n'
    middle = 0.0 if n % 2 else 0.5
    pull = "".join(
        f'[[condition]]\non = "x-{side}"\ntraction = ["{sign}1 MPa", 0, 0]\n' for side, sign in [("min", "-"), ("max", "")]
    )
    ends = probe("a", [(-q + 0.5, middle, 0), (-q + 0.5, -middle, 0)]) + probe("b", [(q + 0.5, middle, 0), (q + 0.5, -middle, 0)])
    ends += probe("low", [(0.5, layer(n, -1), 0)]) + probe("high", [(0.5, layer(n, 1), 0)])
    r = run(body + pull + ends, model, calibrated)
    strain = (r["b_ux_m"] - r["a_ux_m"]) / (2 * q * 1e-3)
    stiffness = T / strain / plane_e - 1
    contraction = None
    if n > 1:
        across = (r["high_uy_m"] - r["low_uy_m"]) / ((n - 1) * 1e-3)
        contraction = -across / strain / plane_nu - 1
    bend = '[[condition]]\non = "x-min"\nthickness = 3\ndisplacement = [0, 0, 0]\n'
    bend += '[[condition]]\non = "x-max"\ntraction = [0, "1 MPa", 0]\n'
    xs = [-q + 0.5, 0.5, q + 0.5]
    bend += "".join(probe(f"w{i}", [(x, middle, 0), (x, -middle, 0)]) for i, x in enumerate(xs))
    r = run(body + bend, model, calibrated) if n > 1 else None
    bending = None
    if r:
        curvature = (r["w0_uy_m"] - 2 * r["w1_uy_m"] + r["w2_uy_m"]) / (q * 1e-3) ** 2
        h = n * 1e-3
        moment = T * h * (length / 2 - 0.5) * 1e-3
        bending = moment / (plane_e * h**3 / 12) / curvature - 1
    return stiffness, contraction, bending


def plate(n, model, calibrated):
    """Plane stress: a plate n nodes thick under tension; stiffness against E, contraction in its plane against ν."""
    body = f'[body]\nbox = {{ size = "72, 36, {n} mm" }}\n[grid]\nspacing = "1 mm"\n'
    pull = "".join(
        f'[[condition]]\non = "x-{side}"\ntraction = ["{sign}1 MPa", 0, 0]\n' for side, sign in [("min", "-"), ("max", "")]
    )
    z = [layer(n, -1), layer(n, 1)]
    probes = "".join(
        probe(name, [(x, y, zz) for zz in z for y in ys for x in xs])
        for name, xs, ys in [("a", [-12.5], [-0.5, 0.5]), ("b", [12.5], [-0.5, 0.5]), ("c", [-0.5, 0.5], [-8.5]), ("d", [-0.5, 0.5], [8.5])]
    )
    r = run(body + pull + probes, model, calibrated)
    if r is None:
        return None, None
    along = (r["b_ux_m"] - r["a_ux_m"]) / 25e-3
    across = (r["d_uy_m"] - r["c_uy_m"]) / 17e-3
    return T / along / E - 1, -across / along / RATIO[model] - 1


def hole(n, model, calibrated):
    """A thick-walled tube in plane strain, hole of radius n spacings, outside 8 times that, under inner pressure; the hole's
    radial displacement against Lamé's."""
    a, b = n * 1e-3, 8 * n * 1e-3
    text = f"""
[solids.hole]
cylinder = {{ axis = "z", radius = "{n} mm" }}
[body]
difference = [{{ cylinder = {{ axis = "z", radius = "{8 * n} mm" }} }}, "hole"]
[grid]
spacing = "1 mm"
plane_strain = "z"
[[condition]]
on = "hole"
pressure = "1 MPa"
"""
    text += probe("e", [(n + 0.5, 0.5, 0), (n + 0.5, -0.5, 0)]) + probe("w", [(-n - 0.5, 0.5, 0), (-n - 0.5, -0.5, 0)])
    r = run(text, model, calibrated)
    # Lamé at the probes' radius.
    x = ((n + 0.5) ** 2 + 0.25) ** 0.5 * 1e-3
    nu = RATIO[model]
    k = T * a**2 / (b**2 - a**2)
    exact = (1 + nu) / E * k * ((1 - 2 * nu) * x + b**2 / x) * (n + 0.5) * 1e-3 / x
    return 0.5 * (r["e_ux_m"] - r["w_ux_m"]) / exact - 1


def plies(n, model, calibrated):
    """Plane strain along y: layers of n nodes of two isotropic materials, E 200 and 50 GPa, 4 pairs, under tension along them;
    stiffness against the mean."""
    layup = "{ thickness = \"%d mm\" }, { thickness = \"%d mm\", material = { class = \"isotropic\", unit = \"GPa\", engineering = { e = 50, nu = %g } } }" % (n, n, RATIO[model])
    h = 8 * n
    length = 6 * h
    q = length // 4
    text = f"""
[body]
box = {{ size = "{length}, {h} mm" }}
[grid]
spacing = "1 mm"
plane_strain = "z"
[[region]]
name = "ply"
layers = {{ axis = "y", repeat = 4, layup = [{layup}] }}
[[condition]]
on = "x-min"
thickness = 1
displacement = ["-{length / 2} um", "free", "free"]
[[condition]]
name = "pull"
on = "x-max"
displacement = ["{length / 2} um", "free", "free"]
[[probe]]
name = "f"
quantity = "reaction"
condition = "pull"
"""
    text += probe("a", [(-q + 0.5, y + 0.5, 0) for y in range(-h // 2, h // 2)]) + probe("b", [(q + 0.5, y + 0.5, 0) for y in range(-h // 2, h // 2)])
    r = run(text, model, calibrated)
    strain = (r["b_ux_m"] - r["a_ux_m"]) / (2 * q * 1e-3)
    stress = r["f_Fx_N"] / (h * 1e-3 * 1e-3)
    return stress / strain / (0.5 * (200e9 + 50e9) / (1 - RATIO[model] ** 2)) - 1


def percent(x):
    return "      –" if x is None else f"{100 * x:+7.1f}"


def table(title, columns, numbers, row):
    print(title + "\n")
    names = [f"{m} {'on' if c else 'off'}" for m, c in MODELS]
    width = 8 * len(columns) + 1
    print("nodes  " + "".join(name.center(width) for name in names))
    print("       " + "".join(" ".join(f"{c:>7}" for c in columns).center(width) for _ in names))
    def found(n, model, calibrated):
        try:
            return row(n, model, calibrated)
        except TypeError:  # a run that did not converge
            return [None] * len(columns)

    for n in numbers:
        cells = (" ".join(percent(x) for x in found(n, m, c)).center(width) for m, c in MODELS)
        print(f"{n:5}  " + "".join(cells), flush=True)
    print(flush=True)


if __name__ == "__main__":
    print("Errors in %; on, off: with and without surface_calibration; horizon 3 spacings, isotropic, ν = 0.25 (central), 0.35 (hybrid).\n")
    table("Strip in plane strain, n nodes thick", ["tension", "contr.", "bending"], [1, 2, 3, 4, 6, 8, 12, 16], strip)
    table("Plate 72 × 36 × n nodes in tension (plane stress)", ["tension", "contr."], [1, 2, 3, 4, 6, 8], plate)
    table("Hole of radius n spacings under pressure: its displacement", ["hole"], [2, 3, 5, 8, 12, 16], lambda *a: [hole(*a)])
    table("Layers n nodes thick (moduli 4 : 1), tension along them", ["tension"], [1, 2, 3, 4, 6, 8], lambda *a: [plies(*a)])
