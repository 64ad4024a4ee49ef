"""Packings, lattices, element tests and sweeps."""

import numpy as np
import pytest

import anisobond as ab


def test_packings_in_and_out(packing, tmp_path):
    assert packing.reached and packing.porosity == pytest.approx(0.48, abs=2e-3)
    for name in ("p.txt", "p.csv", "p.vtp", "p.data"):
        packing.write(tmp_path / name)
        again = ab.Packing.read(tmp_path / name)
        np.testing.assert_allclose(again.centres, packing.centres, atol=1e-9)
        np.testing.assert_allclose(again.cell, packing.cell, rtol=1e-9)
    same = ab.Packing(packing.centres, packing.radii, cell=packing.cell)
    assert len(same) == len(packing) and same.statistics(1.5).to_dict() == packing.statistics(1.5).to_dict()


def test_contacts_are_those_of_all_pairs(packing):
    table = packing.contacts(1.5)
    d = packing.centres[:, None] - packing.centres[None]
    d -= packing.cell * np.round(d / packing.cell)
    near = np.linalg.norm(d, axis=-1) <= 1.5 * (packing.radii[:, None] + packing.radii[None])
    assert len(table) == np.triu(near, 1).sum()


def test_the_lattice_is_the_sum_of_its_arrays(packing, rock):
    bonds = ab.lattice(packing, rock, contact_radius=1.6)
    length = np.linalg.norm(bonds.branches, axis=1)
    n = bonds.branches / length[:, None]
    eye = np.eye(3)
    nn = np.einsum("bi,bj,bk,bl->bijkl", n, n, n, n)
    tt = 0.25 * (
        np.einsum("bj,bk,il->bijkl", n, n, eye)
        + np.einsum("bj,bl,ik->bijkl", n, n, eye)
        + np.einsum("bi,bk,jl->bijkl", n, n, eye)
        + np.einsum("bi,bl,jk->bijkl", n, n, eye)
    ) - nn
    c = np.einsum("b,bijkl->ijkl", length**2 * bonds.normal, nn) + np.einsum("b,bijkl->ijkl", length**2 * bonds.tangential, tt)
    np.testing.assert_allclose(c / np.prod(packing.cell), bonds.summed.full, atol=1e-9 * bonds.summed.norm)


def test_element_tests(packing, rock):
    plain = ab.element_test(packing, rock, contact_radius=1.6)
    assert plain.converged and 0.01 < plain.error < 0.5
    # Uniform strain is an upper bound.
    assert np.linalg.eigvalsh(plain.summed.mandel - plain.measured.mandel).min() > 0
    blocked = ab.element_test(packing, rock, contact_radius=1.6, rotations="blocked")
    assert np.linalg.eigvalsh(blocked.measured.mandel - plain.measured.mandel).min() > -1e-9 * plain.measured.norm
    corrected = ab.element_test(packing, rock, contact_radius=1.6, correct=True)
    assert corrected.error < 2e-4 and "corrected" in str(corrected)


def test_grid_tests():
    perfect = ab.grid_test("KIO3", 5, horizon=2, model="micropolar")
    assert perfect.error < 1e-8 and perfect.stable
    holes = ab.grid_test("KIO3", (5, 5, 4), horizon=2, missing=0.1, voids=1.0, seed=3)
    assert holes.to_dict()["cell"]["missing"] > 10 and holes.error > 0.05


@pytest.mark.parametrize(
    "work",
    [
        lambda p, r, **k: ab.lattice(p, r, contact_radius=1.6, correct=True, **k),
        lambda p, r, **k: ab.element_test(p, r, contact_radius=1.6, **k),
        lambda p, r, **k: ab.element_test(p, r, contact_radius=1.6, method="dynamic", **k),
        lambda p, r, **k: ab.grid_test("KIO3", 4, horizon=2, missing=0.1, correct=True, **k),
    ],
)
def test_iterations_are_told_and_change_nothing(work, packing, rock):
    beats = []
    watched = work(packing, rock, progress=lambda *beat: beats.append(beat))
    counts = [done for done, _, _ in beats]
    assert counts == sorted(counts) and counts[-1] > 10 and all(total == 0 for _, total, _ in beats)
    assert watched.to_dict() == work(packing, rock).to_dict()


def test_a_sweep_goes_on_and_makes_tables(packing, rock, tmp_path):
    packing.write(tmp_path / "p.txt")
    (tmp_path / "table.toml").write_text(
        'packing = "p.txt"\nc11 = "130 MPa"\nc33 = "55 MPa"\nc13 = "28 MPa"\nc12 = "40 MPa"\n'
        "[parameters]\ncontact_radius = [1.4, 1.6]\n"
    )

    class Bar:
        total, n = 0, 0

        def update(self, n):
            self.n += n

    bar = Bar()
    result = ab.sweep(tmp_path / "table.toml", tmp_path / "out", progress=bar)
    assert (bar.n, bar.total) == (2, 2) and not result.failed and len(result.files) == 4
    table = result.table()
    errors = dict(zip(table["contact_radius"], table["relative_error"]))
    assert errors[1.6] == pytest.approx(ab.element_test(packing, rock, contact_radius=1.6).error, rel=1e-6)
    assert ab.sweep(tmp_path / "table.toml", tmp_path / "out").to_dict() == result.to_dict()


def test_a_function_that_fails_stops_the_work(tmp_path, packing):
    def no(*_):
        raise RuntimeError("enough")

    packing.write(tmp_path / "p.txt")
    with pytest.raises(RuntimeError, match="enough"):
        ab.Packing.random(number=3000, radius="1 mm", porosity=0.4, progress=no)


@pytest.mark.parametrize(
    ("make", "fragments"),
    [
        (lambda p, r: ab.element_test(p, r, contact_radius=1.0), ["contact radius"]),
        (lambda p, r: ab.lattice(p, r, axis=[0, 0, 0]), ["axis"]),
        (lambda p, r: ab.lattice(p, r, correct="eliptic"), ["elliptic"]),
        (lambda p, r: ab.lattice(p, r, model="central", correct="elliptic"), ["tangential"]),
        (lambda p, r: ab.lattice("/nowhere.txt", r), ["/nowhere.txt"]),
        (lambda p, r: ab.element_test(p, r, method="dynamic", strain=0), ["strain"]),
        (lambda p, r: ab.Packing.random(), ["number", "cell"]),
        (lambda p, r: ab.Packing.random(number=10, porosity=0.4, coordination=20), ["one"]),
        (lambda p, r: ab.Packing([[0, 0]], 1), ["(…, 3)"]),
        (lambda p, r: ab.Packing([[0, 0, 0]], -1), ["radius"]),
        (lambda p, r: ab.Packing.crystal("fc", radius=1), ["fcc"]),
        (lambda p, r: ab.grid_test("Si", 0), ["0"]),
        (lambda p, r: ab.grid_test("Si", 4, missing=2, horizon=2), ["missing"]),
        (lambda p, r: ab.sweep("/nowhere.toml", "/tmp/never"), ["/nowhere.toml"]),
    ],
)
def test_wrong_input_says_what_to_do(make, fragments, packing, rock):
    with pytest.raises(ab.Error) as caught:
        make(packing, rock)
    assert all(f in str(caught.value) for f in fragments), caught.value
