"""Calibrations: arrays against the tensor they promise, evidence, tables, refusals."""

import copy
import json
import pickle
import subprocess
import sys

import numpy as np
import pytest

import anisobond as ab


def summed(calibration):
    """C = ½ Σ ω c |ξ| n⊗n⊗n⊗n ΔV (eq 29 of the peridynamics document), from the arrays alone."""
    grid = calibration.neighbourhood
    length = np.linalg.norm(grid.vectors, axis=1)
    n = grid.vectors / length[:, None]
    share = 0.5 * grid.influence * length * grid.spacing**3 * calibration.micromodulus
    return np.einsum("b,bi,bj,bk,bl->ijkl", share, n, n, n, n)


@pytest.mark.parametrize("material", ["KIO3", "CoTeO4", "Pyroceram"])
def test_the_arrays_make_the_reached_tensor(material):
    bonds = ab.calibrate(material, horizon=4, spacing="2 mm")
    np.testing.assert_allclose(summed(bonds), bonds.reached.full, atol=1e-9 * bonds.reached.norm)
    assert bonds.micromodulus.min() >= 0
    assert bonds.error == pytest.approx(bonds.target.relative_error(bonds.reached), rel=1e-9, abs=1e-13)


def test_numbers_of_the_document():
    bonds = ab.calibrate("CoTeO4")
    gpa = bonds.micromodulus / 1e9
    assert len(bonds.neighbourhood) == 924 and (gpa == 0).sum() == 636
    assert gpa.max() == pytest.approx(1.65645313316, rel=1e-9)
    assert 100 * bonds.error == pytest.approx(4.98802345, rel=1e-8)


def test_models_and_evidence():
    hybrid = ab.calibrate("Te2W", horizon=3, model="hybrid")
    z = ab.Stiffness("Te2W").voigt - hybrid.reached.voigt
    assert hybrid.error < 1e-12 and hybrid.stable and hybrid.nodal_term.shape == (6, 6) and np.abs(z).max() < 1
    micropolar = ab.calibrate("Si", horizon=3, model="micropolar", promise="free-rotations")
    assert micropolar.tangential.shape == micropolar.micromodulus.shape
    infeasible = ab.calibrate("CoTeO4", horizon=3)
    assert not infeasible.reaches_model_limit and 100 * infeasible.error == pytest.approx(5.58526, abs=1e-5)
    assert infeasible.certificate["largest_bond_product"] < 1e-9 < infeasible.certificate["target_product"]
    assert ab.calibrate("Pyroceram", horizon=3).certificate is None


def test_shapes_influences_and_rotations():
    assert len(ab.Neighbourhood(shape="ellipsoid")) == 490 and len(ab.Neighbourhood(shape="cuboid")) == 1286
    turned = ab.Neighbourhood(horizon=3, rotate=["axis:0,0,1,30", np.eye(3)[[1, 2, 0]]])
    assert ab.calibrate("Pyroceram", turned).error < 1e-12
    table = [(0.1, 0.9), (1.0, 0.0)]
    np.testing.assert_allclose(ab.Neighbourhood(horizon=3, influence=table).influence.max(), 0.9 - 0.9 * (1 / 3 - 0.1) / 0.9)
    assert ab.calibrate("Pyroceram", horizon=3, influence="constant", lower_bound="max").micromodulus.min() > 0


def test_arrays_cannot_be_written_and_are_shared():
    bonds = ab.calibrate("Si", horizon=2)
    assert bonds.micromodulus is bonds.micromodulus
    with pytest.raises(ValueError):
        bonds.micromodulus[0] = 1


def test_tables(tmp_path):
    bonds = ab.calibrate("Si", horizon=2, model="micropolar")
    table = bonds.table()
    written = bonds.write(tmp_path)
    names = [line for line in (tmp_path / "bonds.csv").read_text().splitlines() if not line.startswith("#")][0].split(",")
    assert table.columns == names and all(p.is_file() for p in written)
    report = json.loads((tmp_path / "calibration.json").read_text())
    # By which `export` knows that bonds are of their report.
    assert set(report.pop("checksums")) == {"bonds.csv"}
    assert report == bonds.to_dict() == json.loads(bonds.to_json())
    pandas = pytest.importorskip("pandas")
    assert isinstance(bonds.to_pandas(), pandas.DataFrame) and len(bonds.to_pandas()) == len(bonds.micromodulus)
    arrow = pytest.importorskip("pyarrow")
    assert isinstance(bonds.to_arrow(), arrow.Table)
    with pytest.raises(ab.Error, match="did you mean micromodulus"):
        table["micromoduls"]


def test_export(tmp_path):
    ab.calibrate("Pyroceram", horizon=2).write(tmp_path)
    files = ab.export(tmp_path, to="numpy")
    assert any(f.name == "expected.csv" for f in files) and all(f.is_file() for f in files)
    assert ab.report(tmp_path).read_text().startswith("<!")


def test_a_table_of_materials(tmp_path):
    names = [f"c{i}{j}" for i in range(1, 7) for j in range(i, 7)]
    cubic = {"c11": 0, "c22": 0, "c33": 0, "c12": 1, "c13": 1, "c23": 1, "c44": 2, "c55": 2, "c66": 2}

    def row(name, values):
        return ",".join([name, *(str(values[cubic[c]]) if c in cubic else "0" for c in names)])

    rows = [",".join(["id", *names]), row("a", (160, 60, 80)), row("b", (100, 200, 10))]
    (tmp_path / "crystals.csv").write_text("\n".join(rows) + "\n")
    beats = []
    table = ab.calibrate_table(
        tmp_path / "crystals.csv", horizon=2, output=tmp_path / "out", progress=lambda *beat: beats.append(beat)
    )
    assert list(table["id"]) == ["a", "b"] and "positive definite" in table["error"][1]
    assert beats[-1][:2] == (2, 2) and (tmp_path / "out/calibrations.csv").is_file()


def test_tables_have_types_that_do_not_depend_on_the_rows(tmp_path):
    names = [f"c{i}{j}" for i in range(1, 7) for j in range(i, 7)]
    good = {"c11": 160, "c22": 160, "c33": 160, "c12": 60, "c13": 60, "c23": 60, "c44": 80, "c55": 80, "c66": 80}

    def table(*rows):
        lines = [",".join(["id", *names])]
        lines += [",".join([id, *(str(sign * good.get(c, 0)) for c in names)]) for id, sign in rows]
        (tmp_path / "t.csv").write_text("\n".join(lines) + "\n")
        return ab.calibrate_table(tmp_path / "t.csv", horizon=2)

    whole, torn = table(("007", 1), ("1e5", 1), ("true", 1)), table(("007", 1), ("1e5", -1), ("nan", 1))
    assert whole["id"] == whole["material"] == ["007", "1e5", "true"] and torn["id"] == ["007", "1e5", "nan"]
    assert whole["stable"].dtype == torn["stable"].dtype == object
    assert list(whole["stable"]) == [True] * 3 and list(torn["stable"]) == [True, None, True]
    assert torn["error"][0] is None and "positive definite" in torn["error"][1]
    assert whole["sampled_waves"].dtype == whole["line"].dtype == np.int64 and np.isnan(torn["sampled_waves"][1])
    assert torn["neighbourhood.shape"] == ["sphere", None, "sphere"]
    assert json.dumps(torn.to_dict(), allow_nan=False)
    pandas, arrow = pytest.importorskip("pandas"), pytest.importorskip("pyarrow")
    frame = torn.to_pandas()
    assert frame["stable"].dtype == object and list(frame["id"]) == ["007", "1e5", "nan"] and pandas.isna(frame["stable"][1])
    assert torn.to_arrow().schema.field("stable").type == whole.to_arrow().schema.field("stable").type == arrow.bool_()


def test_pickles_are_calibrated_again():
    grid = ab.Neighbourhood(
        horizon=3, shape="ellipsoid", semi_axes=[2, 2.5, 3], influence=[(0.1, 1), (0.5, 0.5), (1, 0.1)],
        spacing="2 mm", rotate=["axis:0,0,1,30", "axis:1,0,0,7"],
    )
    again = pickle.loads(pickle.dumps(grid))
    assert repr(again) == repr(grid) and np.array_equal(again.vectors, grid.vectors)
    assert np.array_equal(again.offsets, grid.offsets) and np.array_equal(again.influence, grid.influence)
    for keywords in ({"model": "micropolar", "promise": "free-rotations"}, {"model": "hybrid"}, {"lower_bound": 1e9}):
        bonds = ab.calibrate("Si", grid, **keywords)
        again = copy.deepcopy(pickle.loads(pickle.dumps(bonds)))
        assert again.to_dict() == bonds.to_dict() and np.array_equal(again.micromodulus, bonds.micromodulus)


def test_arrays_are_made_once():
    bonds = ab.calibrate("Te2W", horizon=2, model="hybrid")
    grid = bonds.neighbourhood
    for of, name in [(grid, "offsets"), (grid, "vectors"), (grid, "influence"), (bonds, "offsets"), (bonds, "vectors")]:
        assert getattr(of, name) is getattr(of, name) and not getattr(of, name).flags.writeable, name
    assert not bonds.nodal_term.flags.writeable


def test_same_numbers_as_the_command_line():
    words = [sys.executable, "-c", "from anisobond._command import main; main()", "calibrate", "KIO3", "--horizon", "3"]
    printed = subprocess.run([*words, "--json"], capture_output=True, text=True, check=True).stdout
    assert json.loads(printed) == ab.calibrate("KIO3", horizon=3).to_dict()
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert printed.strip() == str(ab.calibrate("KIO3", horizon=3)).strip()


def test_advice():
    advice = ab.advise("Te2W")
    assert advice.recommended == "hybrid" and "recommended" in str(advice) and len(advice.table()) >= 3


@pytest.mark.parametrize(
    ("make", "fragments"),
    [
        (lambda: ab.calibrate("Si", model="hybrd"), ["hybrd", "hybrid"]),
        (lambda: ab.calibrate("Si", form="stable"), ["hybrid"]),
        (lambda: ab.calibrate("Si", promise="sum"), ["micropolar"]),
        (lambda: ab.calibrate("Si", model="hybrid", lower_bound="max"), ["central"]),
        (lambda: ab.calibrate("Si", lower_bound=-1), ["≥ 0"]),
        (lambda: ab.calibrate("Si", model="hybrid", metric="energy"), ["central"]),
        (lambda: ab.calibrate("Si", metric="length"), ["norm"]),
        (lambda: ab.calibrate("Si", lower_bound="1 GPa"), ["N/m⁶"]),
        (lambda: ab.calibrate("Si", require_exact=-1), ["require_exact", "≥ 0"]),
        (lambda: ab.calibrate("Si", require_exact="yes"), ["require_exact", "True"]),
        (lambda: ab.calibrate("Si", influence=[[1, 2, 3]]), ["influence has the shape [1, 3]"]),
        (lambda: ab.calibrate("Si", rotate=3), ["rotate"]),
        (lambda: ab.calibrate("Si", influence="gauss"), ["constant, inverse, hat, power"]),
        (lambda: ab.calibrate("Si", horizon=0.5), ["at least 1"]),
        (lambda: ab.calibrate("Si", horizon="6 mmm"), ["horizon"]),
        (lambda: ab.calibrate("Si", shape="ball"), ["sphere, cube"]),
        (lambda: ab.calibrate("Si", semi_axes=[4, 5, 6]), ["ellipsoid"]),
        (lambda: ab.calibrate("Si", ab.Neighbourhood(horizon=2), horizon=3), ["horizon"]),
        (lambda: ab.export("/nowhere", to="lammps"), ["/nowhere"]),
        (lambda: ab.export("/nowhere", to="lamps"), ["lammps"]),
    ],
)
def test_wrong_input_says_what_to_do(make, fragments):
    with pytest.raises(ab.Error) as caught:
        make()
    assert all(f in str(caught.value) for f in fragments), caught.value


def test_not_exact_carries_what_was_reached():
    with pytest.raises(ab.NotExact, match="not to the required") as caught:
        ab.calibrate("Si", horizon=2, require_exact=1e-9)
    assert caught.value.calibration.error > 1e-9
    assert ab.calibrate("Pyroceram", horizon=3, require_exact=1e-9).error < 1e-9
    with pytest.raises(ab.NotExact, match="1.00000e-7 %"):
        ab.calibrate("Si", horizon=2, require_exact=True)
    assert ab.calibrate("Si", horizon=2, require_exact=False).error > 1e-9


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ab.calibrate("Si", horizn=3), "calibrate\\(\\) has no keyword horizn; did you mean horizon?"),
        (lambda: ab.calibrate("Si", modle="hybrid"), "did you mean model?"),
        (lambda: ab.grid_test("Si", 4, seeed=1), "grid_test\\(\\) has no keyword seeed; did you mean seed?"),
        (lambda: ab.calibrate_table("t.csv", progres=True), "calibrate_table\\(\\).*did you mean progress?"),
    ],
)
def test_unknown_keywords_are_named(make, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text("id,c11\n")
    with pytest.raises(TypeError, match=said):
        make()
