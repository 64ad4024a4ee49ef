"""How far few nodes across a dimension are off: thin strips and plates, small holes, thin plies, small grains.

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


def run(text, model, calibrated, horizon=3):
    head = f"""
name = "coarse"
material = {{ class = "isotropic", unit = "GPa", engineering = {{ e = 200, nu = {RATIO[model]} }} }}
[model]
bonds = "{model}"
surface_calibration = {str(calibrated).lower()}
[equilibrium]
tolerance = 1e-7
"""
    return finished(head + text.replace("[grid]\n", f"[grid]\nhorizon = {horizon}\n"))


def finished(text):
    """The last row of a case's probes; None if it failed."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.toml"
        case.write_text(text)
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


def strip(n, model, calibrated, horizon=3):
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
    r = run(body + pull + ends, model, calibrated, horizon)
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
    r = run(body + bend, model, calibrated, horizon) if n > 1 else None
    bending = None
    if r:
        curvature = (r["w0_uy_m"] - 2 * r["w1_uy_m"] + r["w2_uy_m"]) / (q * 1e-3) ** 2
        h = n * 1e-3
        moment = T * h * (length / 2 - 0.5) * 1e-3
        bending = moment / (plane_e * h**3 / 12) / curvature - 1
    return stiffness, contraction, bending


def plate(n, model, calibrated, horizon=3):
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
    r = run(body + pull + probes, model, calibrated, horizon)
    if r is None:
        return None, None
    along = (r["b_ux_m"] - r["a_ux_m"]) / 25e-3
    across = (r["d_uy_m"] - r["c_uy_m"]) / 17e-3
    return T / along / E - 1, -across / along / RATIO[model] - 1


def hole(n, model, calibrated, horizon=3):
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
    r = run(text, model, calibrated, horizon)
    # Lamé at the probes' radius.
    x = ((n + 0.5) ** 2 + 0.25) ** 0.5 * 1e-3
    nu = RATIO[model]
    k = T * a**2 / (b**2 - a**2)
    exact = (1 + nu) / E * k * ((1 - 2 * nu) * x + b**2 / x) * (n + 0.5) * 1e-3 / x
    return 0.5 * (r["e_ux_m"] - r["w_ux_m"]) / exact - 1


def plies(n, model, calibrated, horizon=3):
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
    r = run(text, model, calibrated, horizon)
    strain = (r["b_ux_m"] - r["a_ux_m"]) / (2 * q * 1e-3)
    stress = r["f_Fx_N"] / (h * 1e-3 * 1e-3)
    return stress / strain / (0.5 * (200e9 + 50e9) / (1 - RATIO[model] ** 2)) - 1


def percent(x):
    return "      –" if x is None else f"{100 * x:+7.1f}"


def crystal(n, horizon, cut):
    """Force that stretches a cube of copper, periodic across the tension and cut into forty grains, n nodes across in the mean."""
    side = 20.0
    text = f"""
name = "grains"
[body]
box = {{ size = "{side}, {side}, {side} um" }}
[grid]
spacing = "{side / round(n * 40 ** (1 / 3))!r} um"
horizon = {horizon}
periodic = ["y", "z"]
[model]
bonds = "hybrid"
[[region]]
name = "grain"
material = {{ class = "cubic", unit = "GPa", c11 = 168.4, c12 = 121.4, c44 = 75.4 }}
{cut}
[[condition]]
on = "x-min"
displacement = [0, 0, 0]
[[condition]]
name = "pulled"
on = "x-max"
displacement = ["20 nm", 0, 0]
[equilibrium]
tolerance = 1e-6
[[probe]]
name = "f"
quantity = "reaction"
condition = "pulled"
"""
    return finished(text)["f_Fx_N"]


def grains(numbers, finest, horizons, seeds):
    """Stiffness over that of one crystal on the same grid, whose ends are as stiff; compared with the same grains on a fine grid."""
    print(f"Copper grains n nodes across in the mean: stiffness, against grains {finest} nodes across; mean of {len(seeds)} polycrystals and largest\n")
    print("nodes  " + "".join(f"horizon {h}".center(22) for h in horizons))

    def stiffness(n, h):
        cuts = [f'grains = {{ number = 40, seed = {seed}, orientations = "random" }}' for seed in seeds]
        whole = crystal(n, h, "")
        return [crystal(n, h, cut) / whole for cut in cuts]

    exact = {h: stiffness(finest, h) for h in horizons}
    for n in numbers:
        cells = []
        for h in horizons:
            errors = [found / fine - 1 for found, fine in zip(stiffness(n, h), exact[h])]
            cells.append((percent(sum(errors) / len(errors)) + percent(max(errors, key=abs))).center(22))
        print(f"{n:5}  " + "".join(cells), flush=True)
    print(flush=True)


def table(title, columns, numbers, row, kinds):
    print(title + "\n")
    width = max(8 * len(columns), 11) + 2
    print("nodes  " + "".join(name.center(width) for name, _ in kinds))
    print("       " + "".join(" ".join(f"{c:>7}" for c in columns).center(width) for _ in kinds))

    def found(n, kind):
        try:
            return row(n, *kind)
        except TypeError:  # a run that did not converge
            return [None] * len(columns)

    for n in numbers:
        cells = (" ".join(percent(x) for x in found(n, kind)).center(width) for _, kind in kinds)
        print(f"{n:5}  " + "".join(cells), flush=True)
    print(flush=True)


def holes_and_layers(kinds, radii, layers):
    table("Hole of radius n spacings under pressure: its displacement", ["hole"], radii, lambda *a: [hole(*a)], kinds)
    table("Layers n nodes thick (moduli 4 : 1), tension along them", ["tension"], layers, lambda *a: [plies(*a)], kinds)


if __name__ == "__main__":
    both = [(True, "on"), (False, "off")]
    print("Errors in %; on, off: with and without surface_calibration; isotropic, ν = 0.25 (central), 0.35 (hybrid).\n")
    print("Horizon 3 spacings\n")
    kinds = [(f"{m} {word}", (m, on, 3)) for m in RATIO for on, word in both]
    table("Strip in plane strain, n nodes thick", ["tension", "contr.", "bending"], [1, 2, 3, 4, 6, 8, 12, 16], strip, kinds)
    table("Plate 72 × 36 × n nodes in tension (plane stress)", ["tension", "contr."], [1, 2, 3, 4, 6, 8], plate, kinds)
    holes_and_layers(kinds, [2, 3, 5, 8, 12, 16], [1, 2, 3, 4, 6, 8])
    print("Central bonds, horizons of 2, 3 and 4 spacings\n")
    kinds = [(f"{h} {word}", ("central", on, h)) for h in [2, 3, 4] for on, word in both]
    table("Strip in plane strain, n nodes thick", ["tension", "bending"], range(1, 9), lambda *a: strip(*a)[::2], kinds)
    holes_and_layers(kinds, [2, 3, 4, 5], range(1, 9))
    grains([2, 3, 4, 6], 12, [2, 3], [7, 8, 9, 10])
