#!/usr/bin/env bash
# Pages of results in a real browser: they draw, turn, cut and zoom by keys, in light and dark, fetch nothing and print
# nothing on the console; and the studio, its form filled in as a person does. Needs Chromium and Python 3 with venv; about a minute.
set -euo pipefail
cd "$(dirname "$0")/.."
work=${1:-target/pages}
rm -rf "$work"/results "$work"/url
mkdir -p "$work"/results
python=${PAGES_PYTHON:-$work/venv/bin/python}
if [ ! -x "$python" ]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet websocket-client
fi
if [ -z "${ANISOBOND:-}" ]; then
    cargo build --release --quiet -p anisobond-cli
    ANISOBOND=target/release/anisobond
fi
anisobond() { "$ANISOBOND" "$@" > "$work/log" 2>&1 || { cat "$work/log"; false; }; }
results=$work/results
anisobond calibrate KIO3 --horizon 6 -o "$results/calibration"
anisobond pack --number 100000 --porosity 0.45 --seed 1 -o "$results/packing.csv"
anisobond lattice "$results/packing.csv" cases/materials/rock.toml --contact-radius 1.3 -o "$results/lattice"
anisobond pack --number 400 --porosity 0.42 --seed 1 -o "$results/small.csv"
anisobond element-test "$results/small.csv" cases/materials/rock.toml --contact-radius 1.6 -o "$results/element-test"
anisobond run cases/wave.toml -o "$results/run"
anisobond calibrate Te2W --model micropolar --horizon 3 -o "$results/micropolar"
printf '[parameters]\ncontact_radius = [1.4, 1.6]\nmodel = ["central", "micropolar"]\n[fixed]\npacking = "small.csv"\nmaterial = "Si"\n' > "$results/sweep.toml"
anisobond sweep "$results/sweep.toml" -o "$results/sweep"
pages=()
for kind in micropolar sweep calibration lattice element-test run; do
    anisobond report "$results/$kind" -o "$results/$kind.html"
    pages+=("$results/$kind.html")
done
"$ANISOBOND" studio -o "$results/studio" > "$work/url" 2> "$work/log" &
studio=$!
trap 'kill $studio 2> /dev/null || true' EXIT
for _ in $(seq 100); do [ -s "$work/url" ] && break; sleep 0.1; done
"$python" verification/pages/drive.py "${pages[@]}" --pictures "$work/pictures" --studio "$(cat "$work/url")"
