#!/usr/bin/env bash
# Fracture: the energy that a split body loses, the balance of energies, branching glass, Kalthoff and Winkler's plate, cracks that
# follow a weak direction. Prints tables and keeps them in docs/fracture-results.md, which docs/fracture.md explains; folders with
# pictures in target/cracks. About ten minutes on two cores, building not counted.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release --locked --quiet
program=target/release/anisobond
folder=target/cracks
rm -rf "$folder"
mkdir -p "$folder"

# row TITLE CASE [--set …]: run a case, print a row of the table.
row() {
  local title=$1 case=$2 name
  shift 2
  name=$(tr -c 'a-z0-9\n' '-' <<<"${title,,}")
  $program run "cases/$case.toml" "$@" -o "$folder/$name" >"$folder/$name.log" 2>&1
  python3 - "$title" "$folder/$name/summary.json" <<'PYTHON'
import json, math, sys

title, path = sys.argv[1:]
run = json.load(open(path))
crack = (run["cracks"] or [None])[0]
cells = [title]
if crack is None:
    cells += ["no crack"] + [""] * 5
else:
    (x0, y0, _), (x1, y1, _) = crack["start"], crack["tip"]
    line = math.degrees(math.atan2(abs(y1 - y0), x1 - x0))
    fit = math.degrees(math.atan2(abs(crack["direction"][1]), crack["direction"][0]))
    speed = [crack[key] for key in ("speed", "largest_speed")]
    branches = [f"{tip['branch'][1]:.0f}°" for tip in crack["tips"] if tip["branch"]]
    cells += [f"{1e3 * crack['length']:.1f}", f"{line:.1f}°", f"{fit:.1f}°", " ".join(branches) or "–"]
    cells += ["–" if v is None else f"{v:.0f}" for v in speed]
energy = run["energy"]
cells += [str(energy["broken_bonds"]), f"{run['relative_drift']:.0e}", f"{run['seconds']:.0f}"]
print("| " + " | ".join(cells) + " |")
PYTHON
}

{
  printf '# Fracture, measured\n\nWritten by `verification/cracks.sh`; [what it means](fracture.md).\n\n'
  printf 'Energies: tests of split bodies, of a crack through a plate and of the balance.\n\n```text\n'
  cargo test --release --locked --quiet -p anisobond-app --test all -- --include-ignored --nocapture --test-threads 1 cracks:: softening:: |
    sed 's/^\.*//' | grep -E 'J/m2|drift|broken|over by|weak'
  printf '```\n\nThe longest crack of each run: its length, angle to x of the line from start to tip and of the line of least squares,\n'
  printf 'angle between branches, speeds; all bonds that broke; drift of the energy; seconds.\n\n'
  printf '| case | mm | start to tip | least squares | branches | m/s | largest m/s | broken | drift | s |\n'
  printf '|---|---|---|---|---|---|---|---|---|---|\n'
  row 'split, brittle' split
  row 'split, softening' split --set 'model.softening={ linear = 3 }'
  row 'glass' glass-branching
  row 'Kalthoff-Winkler' kalthoff
  row 'Kalthoff-Winkler, 1 mm' kalthoff --set grid.spacing='1 mm'
  row 'Kalthoff-Winkler, horizon 5' kalthoff --set grid.horizon=5
  row 'weak direction 30' weak-plane
  row 'weak direction 45' weak-plane --set orientation.angle=45
} | tee docs/fracture-results.md
