"""Tensors: every way in and out, and what NumPy says of the same."""

import copy
import json
import pickle
import subprocess
import sys

import numpy as np
import pytest

import anisobond as ab

MANDEL = np.array([1, 1, 1, 2**0.5, 2**0.5, 2**0.5])


def random_tensor(seed):
    """A positive definite Voigt matrix (Pa)."""
    a = np.random.default_rng(seed).normal(size=(6, 6))
    return 1e9 * (a @ a.T + 6 * np.eye(6))


@pytest.mark.parametrize("seed", range(5))
def test_forms_are_one_tensor(seed):
    voigt = random_tensor(seed)
    c = ab.Stiffness(voigt)
    np.testing.assert_allclose(c.voigt, voigt, rtol=1e-14)
    np.testing.assert_allclose(c.mandel, voigt * np.outer(MANDEL, MANDEL), rtol=1e-14)
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    for a, (i, j) in enumerate(pairs):
        for b, (k, l) in enumerate(pairs):
            assert c.full[i, j, k, l] == c.full[j, i, l, k] == pytest.approx(voigt[a, b], rel=1e-14)
    np.testing.assert_allclose(c.compliance @ c.voigt, np.eye(6), atol=1e-12)
    assert c.norm == pytest.approx(np.sqrt((c.full**2).sum()), rel=1e-14)
    np.testing.assert_allclose(c.kelvin_moduli, np.linalg.eigvalsh(c.mandel), rtol=1e-10)
    for other in (ab.Stiffness(c.full), ab.Stiffness(c.mandel, order="mandel"), ab.Stiffness(c), pickle.loads(pickle.dumps(c))):
        assert c.relative_error(other) < 1e-15


def test_units_of_files(tmp_path):
    matrix = tmp_path / "matrix.txt"
    matrix.write_text("3 1 1 0 0 0\n1 3 1 0 0 0\n1 1 3 0 0 0\n0 0 0 1 0 0\n0 0 0 0 1 0\n0 0 0 0 0 1\n")
    assert ab.Stiffness(matrix, unit="kbar").voigt[0, 0] == pytest.approx(3e8)
    with pytest.raises(ab.Error, match='no unit is named.*unit="GPa"'):
        ab.Stiffness(matrix)
    with pytest.raises(ab.Error, match="order is given with a file"):
        ab.Stiffness(matrix, unit="kbar", order="voigt")


def test_units_and_orders():
    voigt = random_tensor(7)
    assert ab.Stiffness(voigt).relative_error(ab.Stiffness(voigt / 1e9, unit="GPa")) < 1e-15
    abaqus = [0, 1, 2, 5, 4, 3]
    assert ab.Stiffness(voigt).relative_error(ab.Stiffness(voigt[np.ix_(abaqus, abaqus)], order="abaqus")) < 1e-15


def test_rotation_is_that_of_all_components():
    c = ab.Stiffness(random_tensor(3))
    q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    expected = np.einsum("ai,bj,ck,dl,ijkl->abcd", q, q, q, q, c.full)
    np.testing.assert_allclose(c.rotated(q).full, expected, atol=1e-13 * c.norm)


def test_directional_moduli_and_waves_are_those_of_numpy():
    c = ab.Stiffness(random_tensor(4), density="2500 kg/m3")
    n = np.random.default_rng(2).normal(size=(2, 4, 3))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    s = np.linalg.inv(c.mandel)
    x, y, z = np.moveaxis(n, -1, 0)
    e = np.stack([x * x, y * y, z * z, 2**0.5 * y * z, 2**0.5 * x * z, 2**0.5 * x * y], axis=-1)
    np.testing.assert_allclose(c.young(n), 1 / np.einsum("...a,ab,...b", e, s, e), rtol=1e-10)
    speeds, polarisations = c.waves(n)
    christoffel = np.einsum("ijkl,...j,...l->...ik", c.full, n, n)
    np.testing.assert_allclose(2500 * speeds**2, np.linalg.eigvalsh(christoffel), rtol=1e-9)
    moved = np.einsum("...ik,...wk->...wi", christoffel, polarisations)
    np.testing.assert_allclose(moved, 2500 * speeds[..., None] ** 2 * polarisations, atol=1e-8 * c.norm)


def test_other_packages_are_known_by_what_they_have(monkeypatch):
    voigt = random_tensor(5) / 1e9

    class ElasticTensor:
        def __init__(self):
            self.voigt = voigt

    class StiffnessTensor:
        def matrix(self):
            return voigt

    ElasticTensor.__module__ = "pymatgen.analysis.elasticity.elastic"
    StiffnessTensor.__module__ = "elasticipy.tensors.elasticity"

    class Atoms:
        def get_masses(self):
            return np.array([28.085] * 8)

        def get_volume(self):
            return 160.1

    expected = ab.Stiffness(voigt, unit="GPa")
    assert ab.Stiffness(ElasticTensor()).relative_error(expected) < 1e-15
    assert ab.Stiffness.from_elasticipy(StiffnessTensor()).relative_error(expected) < 1e-15
    assert ab.Stiffness.from_ase(expected.to_ase(), atoms=Atoms()).relative_error(expected) < 1e-14
    assert ab.Stiffness.from_ase(expected.to_ase(), atoms=Atoms()).density == pytest.approx(2330, rel=2e-3)
    assert ab.calibrate(ElasticTensor(), horizon=2).target.relative_error(expected) < 1e-15


def test_pymatgen_itself():
    elastic = pytest.importorskip("pymatgen.analysis.elasticity.elastic")
    c = ab.Stiffness("KIO3")
    there = c.to_pymatgen()
    assert isinstance(there, elastic.ElasticTensor)
    assert ab.Stiffness.from_pymatgen(there).relative_error(c) < 1e-14
    assert there.universal_anisotropy == pytest.approx(c.analyse().to_dict()["moduli"]["universal_anisotropy"], rel=1e-6)


def test_elasticipy_itself():
    pytest.importorskip("elasticipy")
    c = ab.Stiffness("KIO3")
    there = c.to_elasticipy()
    assert ab.Stiffness.from_elasticipy(there).relative_error(c) < 1e-14
    assert ab.Stiffness(there, unit="GPa").relative_error(c) < 1e-14


def test_compliances_are_inverted_and_others_refused():
    c = ab.Stiffness("KIO3")
    elastic = pytest.importorskip("pymatgen.analysis.elasticity.elastic")
    tensors = pytest.importorskip("pymatgen.core.tensors")
    assert ab.Stiffness(c.to_pymatgen().compliance_tensor).relative_error(c) < 1e-13

    class Own(elastic.ElasticTensor):
        """A user's class: its numbers are GPa all the same."""

    assert ab.Stiffness(Own(c.to_pymatgen())).relative_error(c) < 1e-14
    with pytest.raises(ab.Error, match="is no stiffness; give an ElasticTensor"):
        ab.Stiffness(tensors.Tensor(c.full))


def test_compliances_of_elasticipy_are_inverted():
    pytest.importorskip("elasticipy")
    c = ab.Stiffness("Te2W")
    assert ab.Stiffness(c.to_elasticipy().inv()).relative_error(c) < 1e-13


def test_compliances_known_by_their_class_alone():
    compliance = 1e9 * ab.Stiffness("KIO3").compliance

    class ComplianceTensor:
        voigt = compliance

        def matrix(self):
            return compliance

    for module in ("pymatgen.core.elasticity.elastic", "elasticipy.tensors.elasticity"):
        ComplianceTensor.__module__ = module
        assert ab.Stiffness(ComplianceTensor()).relative_error(ab.Stiffness("KIO3")) < 1e-13
        megapascals = ab.Stiffness(ComplianceTensor(), unit="MPa")
        assert megapascals.norm == pytest.approx(1e-3 * ab.Stiffness("KIO3").norm)

    class Strain:
        voigt = compliance

    Strain.__module__ = "pymatgen.analysis.elasticity.strain"
    with pytest.raises(ab.Error, match="no stiffness"):
        ab.Stiffness(Strain())


def test_pickles_copies_and_hashes_are_exact():
    for name in ab.builtin_materials():
        for c in (ab.Stiffness(name, density=2000, source="here"), ab.Stiffness(name).rotated("bunge:10,20,30")):
            for again in (pickle.loads(pickle.dumps(c)), copy.copy(c), copy.deepcopy(c)):
                assert again == c and hash(again) == hash(c) and np.array_equal(again.mandel, c.mandel)
                assert (again.name, again.density, again.source) == (c.name, c.density, c.source)


def test_arrays_of_a_tensor_cannot_be_written_and_copies_can():
    c = ab.Stiffness("KIO3")
    assert not any(a.flags.writeable for a in (c.voigt, c.mandel, c.full, c.compliance, c.kelvin_moduli, c.cauchy_defect))
    assert np.array(c).flags.writeable and np.asarray(c).flags.writeable


def test_numpy_where_numbers_are():
    c = ab.Stiffness("KIO3")
    assert ab.Stiffness.of(stiffness=c.voigt / 1e9, unit="GPa").relative_error(c) < 1e-15
    cubic = ab.Stiffness.of(symmetry="cubic", unit="GPa", c11=np.float32(166), c12=np.float64(64), c44=np.int64(80))
    assert cubic.voigt[0, 0] == 166e9
    assert ab.Stiffness.isotropic(bulk="36 GPa", shear="20 GPa") == ab.Stiffness.isotropic(bulk=36e9, shear=20e9)


def test_directions_of_any_length():
    c = ab.Stiffness("KIO3")
    for length in (1e300, 1e-300, 1e-320, 1e308):
        assert c.young([0, length, 0]) == pytest.approx(c.young([0, 1, 0]), rel=1e-14)


def test_rotations_in_few_digits_and_of_scipy():
    c, turned = ab.Stiffness("KIO3"), ab.Stiffness("KIO3").rotated("axis:0,0,1,45")
    h = 0.70710678
    assert c.rotated([[h, -h, 0], [h, h, 0], [0, 0, 1]]).relative_error(turned) < 1e-14
    with pytest.raises(ab.Error, match="3.5e-2"):
        c.rotated(1.01 * np.eye(3))

    class Rotation:
        def as_matrix(self):
            return np.array([[h, -h, 0], [h, h, 0], [0, 0, 1]])

    assert c.rotated(Rotation()).relative_error(turned) < 1e-14


def test_tables_and_dictionaries():
    c = ab.Stiffness("KIO3")
    table = c.table()
    assert dict(zip(table["component"], table["stiffness"]))["c23"] == c.voigt[1, 2] and len(table) == 21
    assert json.loads(json.dumps(table.to_dict()))["stiffness"][0] == c.voigt[0, 0]
    words = [sys.executable, "-m", "anisobond", "tensor", "KIO3", "--json"]
    printed = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    assert printed.pop("read_as").startswith("built-in material")
    assert printed == c.analyse().to_dict() and printed["directions"] == []
    assert pickle.loads(pickle.dumps(c.analyse())).to_dict() == printed


def test_html_of_a_tensor_says_what_it_comes_to():
    html = ab.Stiffness("Si", density=2330)._repr_html_()
    assert all(word in html for word in ("tetragonal", "cauchy gap", "bulk", "GPa", "2330 kg/m³")), html
    # A tensor that is not positive definite has no averages.
    parts = [ab.Stiffness(name).cauchy_part for name in ab.builtin_materials()]
    for part in parts:
        assert ("bulk" in part._repr_html_()) == (part.kelvin_moduli[0] > 0)


def test_ase_itself():
    build = pytest.importorskip("ase.build")
    c = ab.Stiffness.from_ase(ab.Stiffness("Si").to_ase(), atoms=build.bulk("Si", cubic=True))
    assert c.density == pytest.approx(2330, rel=5e-3)


@pytest.mark.parametrize(
    ("make", "fragments"),
    [
        (lambda: ab.Stiffness("KIO4"), ["did you mean KIO3"]),
        (lambda: ab.Stiffness(np.eye(5)), ["[5, 5]", "6×6"]),
        (lambda: ab.Stiffness(-np.eye(6)), ["positive definite"]),
        (lambda: ab.Stiffness(np.triu(np.ones((6, 6))) + 5 * np.tril(np.ones((6, 6)))), ["stiffness"]),
        (lambda: ab.Stiffness("Si", density=-1), ["density", "positive"]),
        (lambda: ab.Stiffness(np.eye(6), unit="GPs"), ["GPs"]),
        (lambda: ab.Stiffness.of(symmetry="cubic", unit="GPa", c11=10, c12=3), ["c44"]),
        (lambda: ab.Stiffness.of(symmetry="cubic", unit="GPa", c11=10, c12=3, c4=2), ["c4"]),
        (lambda: ab.Stiffness("Si").rotated(2 * np.eye(3)), ["orthogonal"]),
        (lambda: ab.Stiffness(-ab.Stiffness("Si").full), ["positive definite"]),
        (lambda: ab.Stiffness("Si", unit="MPa"), ["unit", "leave it out"]),
        (lambda: ab.Stiffness({"class": "cubic"}, unit="MPa"), ["unit", "key of the dictionary"]),
        (lambda: ab.Stiffness(ab.Stiffness("Si"), order="mandel"), ["order"]),
        (lambda: ab.Stiffness(ab.Stiffness("Si").full, order="voigt"), ["order", "3×3×3×3"]),
        (lambda: ab.Stiffness(np.eye(6) + 1j), ["complex"]),
        (lambda: ab.Stiffness(np.where(np.eye(6) == 1, np.nan, 0)), ["stiffness[0, 0] is NaN"]),
        (lambda: ab.Stiffness(ab.Stiffness("Si").full * np.nan), ["stiffness[0, 0, 0, 0] is NaN"]),
        (lambda: ab.Stiffness.of(symmetry="cubic", unit="GPa", c11=1, c12=np.nan, c44=2), ["c12 is nan"]),
        (lambda: ab.Stiffness("Si").symmetry(tolerance=-1), ["tolerance = -1"]),
        (lambda: ab.Stiffness("Si").symmetry(tolerance=float("nan")), ["tolerance"]),
        (lambda: ab.Stiffness("Si").young([[1, 0, 0], [0, np.inf, 0]]), ["direction[1, 1] is inf"]),
        (lambda: ab.Stiffness.isotropic(bulk="36 m", shear=1), ["bulk", "length"]),
        (lambda: ab.Stiffness("Si").young([0, 0, 0]), ["direction"]),
        (lambda: ab.Stiffness("Si").waves([1, 0, 0]), ["no density"]),
        (lambda: ab.Stiffness("/nowhere/rock.toml"), ["/nowhere/rock.toml"]),
    ],
)
def test_wrong_input_says_what_to_do(make, fragments):
    with pytest.raises(ab.Error) as caught:
        make()
    assert all(f in str(caught.value) for f in fragments), caught.value
    assert isinstance(caught.value, ValueError)


def test_analysis_is_that_of_the_command_line():
    report = ab.Stiffness("KIO3").analyse()
    assert report.to_dict()["symmetry"]["class"] == "triclinic"
    assert str(report).startswith("KIO3") and "symmetry: triclinic" in str(report)
    assert "<table>" in report._repr_html_() and "nan" not in report._repr_html_()
