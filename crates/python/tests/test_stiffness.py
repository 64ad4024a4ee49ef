"""Tensors: every way in and out, and what NumPy says of the same."""

import pickle

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
