#!/usr/bin/env bash
# Bodies on grids against closed forms, and equilibrium against plain conjugate gradients: about half an hour. Rewrites
# docs/bodies.md.
set -euo pipefail
cd "$(dirname "$0")/.."
bodies=$(cargo bench --locked --quiet -p anisobond --bench bodies)
equilibrium=$(cargo bench --locked --quiet -p anisobond --bench equilibrium)
{
  cat <<'TEXT'
# Bodies on grids, measured

Written by `verification/bodies.sh`. Errors are against closed forms (`experiment::closed_forms`); times are of the machine
that ran it, ratios are measured in one run.

## Waves, beams, a pressurised hole

`cargo bench -p anisobond --bench bodies`.

```text
TEXT
  echo "$bodies"
  cat <<'TEXT'
```

## Equilibrium of a block with a hole

`cargo bench -p anisobond --bench equilibrium`: horizon 3 spacings, held at the bottom, pulled at the top, to a relative
residual of 1e-8; Jacobi up to 96³ nodes.

```text
TEXT
  echo "$equilibrium"
  echo '```'
} > docs/bodies.md.part
mv docs/bodies.md.part docs/bodies.md
