"""Every kind of file for ParaView, opened by VTK's own readers: points, cells and values are those of the other files.

VTK must be here: without it these tests fail, for nothing else sees what ParaView refuses.
"""

import csv
import json
import re

import numpy as np
import pytest
import vtk
from vtk.util.numpy_support import vtk_to_numpy

import anisobond as ab
from conftest import REPOSITORY

READERS = {".vtp": vtk.vtkXMLPolyDataReader, ".vti": vtk.vtkXMLImageDataReader}

#: Order of a tensor's components in VTK, and in tables.
VTK_ORDER = ["xx", "yy", "zz", "xy", "yz", "xz"]


def read(path):
    """What VTK makes of a file; whatever it complains of is an error."""
    complaints = []
    reader = READERS[path.suffix]()

    def complain(_, event, text=""):
        complaints.append(text or event)

    complain.CallDataType = "string0"
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, complain)
    reader.SetFileName(str(path))
    reader.Update()
    assert not complaints, f"{path.name}: {complaints}"
    return reader.GetOutput()


def array(data, name, of="GetPointData"):
    """An array of a data set, with the names of its components."""
    found = getattr(data, of)().GetArray(name)
    assert found is not None, name
    names = [found.GetComponentName(k) for k in range(found.GetNumberOfComponents())]
    return vtk_to_numpy(found), names


def points(data):
    return vtk_to_numpy(data.GetPoints().GetData())


def cells(cells_of):
    """The points of cells that all have equally many."""
    ends = vtk_to_numpy(cells_of.GetOffsetsArray())
    return vtk_to_numpy(cells_of.GetConnectivityArray()).reshape(len(ends) - 1, -1)


def table(path):
    """The columns of a CSV file of numbers."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.reader(lines))
    return {name: np.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(rows[0])}


def collection(path):
    """Times and files of a .pvd file, by VTK's own parser of XML."""
    root = vtk.vtkXMLUtilities.ReadElementFromFile(str(path))
    assert root.GetName() == "VTKFile" and root.GetAttribute("type") == "Collection"
    sets = root.FindNestedElementWithName("Collection")
    sets = [sets.GetNestedElement(k) for k in range(sets.GetNumberOfNestedElements())]
    return [(float(s.GetAttribute("timestep")), path.parent / s.GetAttribute("file")) for s in sets]


def check_fields(data, names, packing=False):
    """Every field of the register is there under its name, with its components."""
    fields = ab.fields()
    by_name = {f: k for k, f in enumerate(fields["field"])}
    for name in names:
        row = by_name[name]
        values, components = array(data, fields["array"][row])
        assert len(values) == data.GetNumberOfPoints() and np.isfinite(values).all()
        expected = fields["components"][row].upper().split()
        assert components == (expected or [None]), (name, components)


def mean_of(data, name, inside, columns):
    """The means of a tensor field over points, in the order of a probe's columns."""
    values, _ = array(data, name)
    return [values[inside, VTK_ORDER.index(c)].astype(float).mean() for c in columns]


def probe_row(folder, probe, quantity):
    """The last row of a probe of six components."""
    columns = table(folder / "probes.csv")
    order = ["xx", "yy", "zz", "yz", "xz", "xy"]
    ending = "_Pa" if quantity == "stress" else ""
    return order, [columns[f"{probe}_{quantity}_{c}{ending}"][-1] for c in order]


@pytest.mark.parametrize("model", ["central", "micropolar"])
def test_neighbourhoods(tmp_path, model):
    bonds = ab.calibrate("KIO3", model=model, horizon=3, spacing="2 mm")
    bonds.write(tmp_path)
    data = read(tmp_path / "neighbourhood.vtp")
    np.testing.assert_array_equal(points(data), bonds.vectors)
    assert data.GetNumberOfCells() == data.GetNumberOfVerts() == len(bonds.vectors)
    np.testing.assert_array_equal(cells(data.GetVerts())[:, 0], np.arange(len(bonds.vectors)))
    np.testing.assert_array_equal(array(data, "micromodulus")[0], bonds.micromodulus)
    np.testing.assert_array_equal(array(data, "offset")[0], bonds.offsets)


def test_packings(packing, tmp_path):
    packing.write(tmp_path / "p.vtp")
    data = read(tmp_path / "p.vtp")
    np.testing.assert_array_equal(points(data), packing.centres)
    np.testing.assert_array_equal(array(data, "radius")[0], packing.radii)
    np.testing.assert_array_equal(array(data, "cell", "GetFieldData")[0], packing.cell)
    np.testing.assert_array_equal(cells(data.GetVerts())[:, 0], np.arange(len(packing)))


def test_lattices(packing, rock, tmp_path):
    lattice = ab.lattice(packing, rock, contact_radius=1.6)
    lattice.write(tmp_path)
    data = read(tmp_path / "lattice.vtp")
    lines, places = cells(data.GetLines()), points(data)
    assert data.GetNumberOfCells() == data.GetNumberOfLines() == len(lattice.pairs)
    np.testing.assert_array_equal(lines[:, 0], lattice.pairs[:, 0])
    np.testing.assert_allclose(places[lines[:, 1]] - places[lines[:, 0]], lattice.branches, atol=1e-15)
    np.testing.assert_array_equal(places[: len(packing)], packing.centres)
    np.testing.assert_array_equal(array(data, "radius")[0][: len(packing)], packing.radii)
    for name, values in (("k_n", lattice.normal), ("k_t", lattice.tangential)):
        np.testing.assert_array_equal(array(data, name, "GetCellData")[0], values)


PLATE = """
name = "plate"
material = { class = "isotropic", unit = "GPa", engineering = { e = 10, nu = 0.25 } }
[solids.hole]
cylinder = { axis = "z", radius = "4 mm" }
[body]
difference = [{ box = { size = "18, 14, LAYERS mm" } }, "hole"]
[grid]
spacing = "1 mm"
horizon = 2
PLANE
[[condition]]
on = "x-min"
displacement = [0, 0, 0]
[[condition]]
on = "x-max"
traction = ["1 MPa", 0, 0]
[equilibrium]
steps = 2
[[probe]]
name = "end"
quantity = "stress"
on = "x-max"
[[probe]]
name = "all"
quantity = "strain"
on = "all"
[output]
fields = FIELDS
frames = 2
slices = [{ axis = "z", field = "stress", component = "xx" }, { axis = "z", field = "stress" }, { axis = "z", field = "damage" }]
"""


@pytest.mark.parametrize("layers", [1, 4])
def test_frames_of_a_grid(tmp_path, layers):
    names = list(ab.fields()["field"])
    text = PLATE.replace("LAYERS", str(layers)).replace("FIELDS", json.dumps(names))
    text = text.replace("PLANE", 'plane_strain = "z"' if layers == 1 else "")
    ab.run(ab.Case(text), tmp_path / "plate")
    frames = collection(tmp_path / "plate/frames.pvd")
    assert [time for time, _ in frames] == [0, 0.5, 1]
    data = [read(path) for _, path in frames][-1]
    check_fields(data, names)
    assert data.GetDimensions() == (18, 14, layers)
    where = np.array([data.GetPoint(k) for k in range(data.GetNumberOfPoints())])
    np.testing.assert_allclose(where[0], [-8.5e-3, -6.5e-3, 0 if layers == 1 else -1.5e-3], atol=1e-15)
    there = np.hypot(where[:, 0], where[:, 1]) > 4e-3
    region, _ = array(data, "region")
    np.testing.assert_array_equal(region > 0, there)
    # Slices are the same numbers.
    layer = layers // 2 * 18 * 14
    stress = array(data, "stress (Pa)")[0][layer : layer + 18 * 14].reshape(14, 18, 6)
    hole = ~there[layer : layer + 18 * 14].reshape(14, 18)
    norm = np.sqrt((stress[..., :3] ** 2).sum(-1) + 2 * (stress[..., 3:] ** 2).sum(-1))
    for number, values in ((1, stress[..., 0]), (2, norm)):
        image = np.load(tmp_path / f"plate/slice-{number}-00002.npy")
        np.testing.assert_array_equal(np.isnan(image), hole)
        np.testing.assert_allclose(image[~hole], values[~hole], rtol=1e-5)
    # Probes are their means.
    order, row = probe_row(tmp_path / "plate", "end", "stress")
    end = where[:, 0] > 8e-3
    scale = np.abs(array(data, "stress (Pa)")[0]).max()
    np.testing.assert_allclose(mean_of(data, "stress (Pa)", end, order), row, atol=1e-6 * scale)
    order, row = probe_row(tmp_path / "plate", "all", "strain")
    np.testing.assert_allclose(mean_of(data, "strain", there, order), row, atol=1e-6 * scale / 1e10)
    # Scalars are what their names say.
    s = array(data, "stress (Pa)")[0][there].astype(float)
    deviator = s - np.repeat((s[:, :3].mean(1)[:, None]), 6, 1) * [1, 1, 1, 0, 0, 0]
    mises = np.sqrt(1.5 * ((deviator[:, :3] ** 2).sum(1) + 2 * (deviator[:, 3:] ** 2).sum(1)))
    np.testing.assert_allclose(array(data, "von Mises stress (Pa)")[0][there], mises, rtol=1e-4)
    energy = array(data, "energy density (J/m³)")[0].astype(float).sum() * 1e-9
    assert energy == pytest.approx(table(tmp_path / "plate/probes.csv")["strain_J"][-1], rel=1e-5)
    check_hole(data, there)


def check_hole(data, there):
    """A hole is one for the filters that ParaView draws with: no cell and no point in it."""
    shape = data.GetDimensions()
    solid = there.reshape(shape[::-1])
    whole = solid
    for axis in range(3):
        if whole.shape[axis] > 1:
            ahead, behind = [slice(None)] * 3, [slice(None)] * 3
            ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
            whole = whole[tuple(ahead)] & whole[tuple(behind)]
    assert 0 < whole.sum() < whole.size and data.HasAnyBlankCells() and data.HasAnyBlankPoints()
    assert sum(data.IsCellVisible(k) for k in range(data.GetNumberOfCells())) == whole.sum()
    threshold = vtk.vtkThreshold()
    threshold.SetInputData(data)
    threshold.SetInputArrayToProcess(0, 0, 0, 0, "region")
    threshold.SetLowerThreshold(-1)
    threshold.SetUpperThreshold(10)
    threshold.Update()
    assert threshold.GetOutput().GetNumberOfCells() == whole.sum()
    # The surface: faces of cells that have no cell beyond; of one layer the cells themselves.
    faces = whole.sum()
    if shape[2] > 1:
        padded = np.pad(whole, 1).astype(int)
        faces = sum(np.abs(np.diff(padded, axis=axis)).sum() for axis in range(3))
    for surface in (vtk.vtkDataSetSurfaceFilter(), vtk.vtkGeometryFilter()):
        surface.SetInputData(data)
        surface.Update()
        # Of flat images the first one passes hidden cells on, with their mark, and mappers leave them out.
        marks = surface.GetOutput().GetCellGhostArray()
        hidden = 0 if marks is None else (vtk_to_numpy(marks) & vtk.vtkDataSetAttributes.HIDDENCELL > 0).sum()
        assert surface.GetOutput().GetNumberOfCells() - hidden == faces


def test_a_whole_block_hides_nothing(wave, tmp_path):
    run = ab.run(wave, tmp_path / "wave")
    frames = collection(tmp_path / "wave/frames.pvd")
    assert len(frames) == 3 and frames[-1][0] == pytest.approx(run.to_dict()["time"], rel=1e-12)
    data = read(frames[-1][1])
    assert not data.HasAnyBlankCells() and data.GetPointData().GetNumberOfArrays() == 2
    # The probe is at a node.
    node = data.FindPoint(19.5e-3, 0.5e-3, 0.5e-3)
    probes = table(tmp_path / "wave/probes.csv")
    assert array(data, "displacement (m)")[0][node, 0] == pytest.approx(probes["first_ux_m"][-1], rel=1e-5)


BAR = """
lattice = "packing"
material = { class = "isotropic", unit = "GPa", engineering = { e = 20, nu = 0.2 } }
[body]
box = { size = "24, 12, 12 mm" }
[grid]
spacing = "1 mm"
[packing]
radius = "1 mm"
number = 80
seed = 2
contact_radius = 1.8
[[condition]]
on = "x-min"
displacement = [0, 0, 0]
[[condition]]
on = "x-max"
traction = ["10 MPa", 0, 0]
[equilibrium]
[[probe]]
name = "all"
quantity = "stress"
on = "all"
[output]
fields = FIELDS
frames = 1
slices = [{ axis = "z", field = "von_mises" }]
"""


def test_frames_of_a_packing(tmp_path):
    names = list(ab.fields()["field"])
    run = ab.run(ab.Case(BAR.replace("FIELDS", json.dumps(names))), tmp_path / "bar")
    frames = collection(tmp_path / "bar/frames.pvd")
    assert [path.suffix for _, path in frames] == [".vtp", ".vtp"]
    first, last = (read(path) for _, path in frames)
    check_fields(last, names)
    spheres = run.to_dict()["nodes"]
    assert last.GetNumberOfPoints() == last.GetNumberOfVerts() == last.GetNumberOfCells() == spheres
    np.testing.assert_array_equal(cells(last.GetVerts())[:, 0], np.arange(spheres))
    moved, u = points(last) - points(first), array(last, "displacement (m)")[0]
    np.testing.assert_allclose(moved, u, atol=1e-8)
    assert (array(last, "radius (m)")[0] == np.float32(1e-3)).all()
    order, row = probe_row(tmp_path / "bar", "all", "stress")
    means = mean_of(last, "stress (Pa)", slice(None), order)
    np.testing.assert_allclose(means, row, atol=1e-5 * max(map(abs, row)))


def test_no_other_kind_is_written():
    """Names of files for VTK in the source: a new kind needs a test here."""
    kinds = set()
    for path in (REPOSITORY / "crates").rglob("*.rs"):
        if "tests" not in path.parts:
            kinds |= set(re.findall(r'VTKFile type=\\?"(\{?\w+\}?)', path.read_text()))
            # What readers compare with, and what comments name, is not written.
            written = re.findall(r'(?<!`)(?<!starts_with\(b")# vtk DataFile', path.read_text())
            kinds |= {"legacy" for _ in written}
            kinds |= set(re.findall(r'Appended::new\("(\w+)"\)', path.read_text()))
    assert kinds == {"PolyData", "ImageData", "Collection", "{kind}"}
