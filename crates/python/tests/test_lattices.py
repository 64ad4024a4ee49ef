"""Packings, lattices, element tests and sweeps."""

import copy
import json
import pickle

import numpy as np
import pytest

import anisobond as ab


def test_packings_of_other_programs(tmp_path):
    table = tmp_path / "spheres.dat"
    table.write_text("x [mm];y [mm];z [mm];D [mm];tag\n1,5;2,5;3,5;1;a\n3,5;2,5;3,5;1;b\n")
    packing = ab.Packing.read(table)
    np.testing.assert_allclose(packing.radii, [5e-4, 5e-4])
    assert packing.read_as.startswith("table with headings, decimal commas, lengths in mm")
    assert packing.columns[3:] == [("D [mm]", "diameter (mm)"), ("tag", "nothing")] and packing.notes == []
    dump = tmp_path / "dump"
    step = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp pp\n0 4\n0 4\n0 4\nITEM: ATOMS id type xs ys zs\n1 1 {} .5 .5\n"
    dump.write_text(step.format(0, 0.25) + step.format(100, 0.75))
    packing = ab.Packing.read(dump, length_unit="mm", frame=0, type_radii="1 mm")
    np.testing.assert_allclose(packing.centres, [[1e-3, 2e-3, 2e-3]])
    np.testing.assert_allclose(packing.radii, [1e-3])
    with pytest.raises(ab.Error, match='name it with length_unit="mm"'):
        ab.Packing.read(dump, type_radii="1 mm")
    with pytest.raises(ab.Error, match="there is no time step 7 in the dump; it has 0 and 100"):
        ab.Packing.read(dump, length_unit="mm", frame=7, type_radii="1 mm")
    bare = tmp_path / "bare.txt"
    bare.write_text("4 4 4\n1 2 2 .1\n")
    with pytest.warns(UserWarning, match="no unit of length is named"):
        assert ab.Packing.read(bare).notes
    assert ab.Packing([[0, 0, 0]], 1).read_as is None


def test_packings_in_and_out(packing, tmp_path):
    assert packing.reached and packing.porosity == pytest.approx(0.48, abs=2e-3)
    for name in ("p.txt", "p.csv", "p.vtp", "p.data"):
        packing.write(tmp_path / name)
        again = ab.Packing.read(tmp_path / name)
        np.testing.assert_allclose(again.centres, packing.centres, atol=1e-9)
        np.testing.assert_allclose(again.cell, packing.cell, rtol=1e-9)
    same = ab.Packing(packing.centres, packing.radii, cell=packing.cell)
    assert len(same) == len(packing) and same.statistics(1.5).to_dict() == packing.statistics(1.5).to_dict()


def test_packings_are_pickled_with_how_they_came_about(packing):
    again = copy.copy(pickle.loads(pickle.dumps(packing)))
    assert np.array_equal(again.centres, packing.centres) and np.array_equal(again.cell, packing.cell)
    assert np.array_equal(again.radii, packing.radii) and again.generation == packing.generation and again.reached
    free = pickle.loads(pickle.dumps(ab.Packing([[0, 0, 0], [1, 0, 0]], "300 mm")))
    assert free.cell is None and free.generation is None and free.radii[1] == 0.3


def test_arrays_are_made_once(packing, rock):
    bonds = ab.lattice(packing, rock, contact_radius=1.6)
    for of, names in [(packing, ("centres", "radii", "cell")), (bonds, ("pairs", "branches", "normal", "tangential"))]:
        assert all(getattr(of, n) is getattr(of, n) and not getattr(of, n).flags.writeable for n in names)


def test_numpy_where_numbers_are():
    assert len(ab.Packing.crystal("sc", radius="1 mm", cells=3)) == len(ab.Packing.crystal("sc", radius=1, cells=[3, 3, 3])) == 27
    assert len(ab.Packing.crystal("sc", radius=1, cells=np.array([1, 2, 3]))) == 6
    rows = np.array([(0.02, 0.5), (0.03, 0.5)])
    assert set(ab.Packing.random(number=np.int64(40), radii=rows, porosity=0.6).radii.round(12)) == {0.02, 0.03}
    test = ab.grid_test("KIO3", np.array([4, 4, 5]), horizon=2, voids=np.array([[2, 2, 2, 0.5]]))
    assert test.to_dict()["cell"]["missing"] == 1


def test_every_result_is_a_table_and_a_dictionary(packing, rock):
    test = ab.element_test(packing, rock, contact_radius=1.6)
    cell = ab.grid_test("KIO3", 4, horizon=2)
    results = [packing, packing.statistics(), ab.lattice(packing, rock), test, cell, ab.advise("Si"), rock, ab.Neighbourhood(horizon=2)]
    for result in results:
        assert json.loads(json.dumps(result.to_dict(), allow_nan=False)), result
        assert len(result.table()) > 0 and json.dumps(result.table().to_dict(), allow_nan=False)
        assert "<table>" in result._repr_html_() and "&lt;" not in result._repr_html_(), result
    assert test.table()["measured.c11"][0] == pytest.approx(test.measured.voigt[0, 0], rel=1e-14)
    pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    for result in results:
        assert len(result.to_pandas()) == len(result.table()) == result.to_arrow().num_rows


def test_the_hole_and_its_refusals():
    # The isotropic closed form, u = p a²/(2 G r), along an axis that is none of the coordinates'.
    glass = ab.Stiffness.isotropic(bulk="36 GPa", shear="20 GPa")
    hole = ab.Cavity(glass, radius="2 m", pressure="3 MPa", axis=[1, 1, 1])
    away = np.array([1, -1, 0]) / 2**0.5
    u = hole.displacement([2 * away, 5 * away])
    np.testing.assert_allclose(u, [3e6 * 4 / (2 * 20e9 * r) * away for r in (2, 5)], rtol=1e-9, atol=1e-13)
    assert np.array(hole.to_dict()["wall"]) @ away == pytest.approx(u[0]) and "<table>" in hole._repr_html_()
    for place in ([0, 0, 0], [[1, 0, 0], [2, 2, 2]], [np.nan, 0, 0], [np.inf, 0, 0]):
        for what in (hole.displacement, hole.hoop_stress):
            with pytest.raises(ab.Error, match="axis|finite"):
                what(place)


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
        (lambda p, r: ab.element_test(p, r, strain=-0.02), ["strain", "dynamic"]),
        (lambda p, r: ab.Packing.random(number=9, radius=1, radii=[(1, 1)]), ["one of them"]),
        (lambda p, r: ab.Packing.random(number=9, seed=-1), ["seed = -1"]),
        (lambda p, r: ab.Packing.random(number=-9), ["number = -9"]),
        (lambda p, r: ab.Packing.crystal("sc", radius=1, seed=-1), ["seed = -1"]),
        (lambda p, r: ab.Packing.crystal("sc", radius=1, cells=[3, 3]), ["cells = [3, 3]"]),
        (lambda p, r: ab.grid_test("Si", 4, horizon=2, seed=-1), ["seed = -1"]),
        (lambda p, r: ab.set_threads(-1), ["threads = -1"]),
        (lambda p, r: ab.Packing([[0, 0, np.nan]], 1), ["centres[0, 2] is NaN"]),
        (lambda p, r: ab.lattice(ab.Packing(p.centres, p.radii), r), ["no periodic cell", "edges of its cell"]),
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
