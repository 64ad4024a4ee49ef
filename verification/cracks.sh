#!/usr/bin/env bash
# Fracture: the energy that a split body loses, branching glass, Kalthoff and Winkler's plate, cracks that follow a weak
# direction. Rewrites docs/fracture-results.md, which docs/fracture.md explains; folders with pictures in target/cracks.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release --locked --quiet
energies=$(cargo test --release --locked --quiet -p anisobond --test cracks -- --nocapture --test-threads 1)
program=target/release/anisobond
folder=target/cracks
rm -rf "$folder"
mkdir -p "$folder"

# run NAME CASE [--set …]
run() {
  local name=$1 case=$2
  shift 2
  echo '```text'
  $program run "cases/$case.toml" "$@" -o "$folder/$name" 2>&1
  echo '```'
}

{
  cat <<'TEXT'
# Fracture, measured

Written by `verification/cracks.sh`; [what it means](fracture.md).

## Energy of a split body

```text
TEXT
  grep -E 'J/m2' <<<"$energies"
  printf '```\n\n## Branching glass\n\n'
  run glass glass-branching
  printf '\nAt half the time step:\n\n'
  run glass-half glass-branching --set motion.safety=0.45
  printf '\n## Kalthoff and Winkler\n\n'
  run kalthoff kalthoff
  for angle in 20 30; do
    sin=$(awk "BEGIN { print sin($angle * atan2(0, -1) / 180) }")
    cos=$(awk "BEGIN { print cos($angle * atan2(0, -1) / 180) }")
    printf '\n## Weak direction at %s° (%s, %s)\n\n' "$angle" "$cos" "$sin"
    run "weak-$angle" weak-plane --set "fracture.directional.0.normal=[-$sin, $cos, 0]" \
      --set "fracture.directional.1.normal=[$cos, $sin, 0]"
  done
} >docs/fracture-results.md
