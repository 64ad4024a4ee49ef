#!/usr/bin/env bash
# Bodies on grids against closed forms, and equilibrium against plain conjugate gradients: about twenty minutes on two quiet
# cores. Rewrites docs/bodies.md. Needs Python with numpy and scipy (PYTHON=… chooses it).
set -euo pipefail
cd "$(dirname "$0")/.."
bodies=$(cargo bench --locked --quiet -p anisobond-app --bench bodies)
rules=$("${PYTHON:-python3}" verification/surface_rules.py)
cargo build --locked --quiet --release -p anisobond-cli
coarse=$("${PYTHON:-python3}" verification/coarse.py target/release/anisobond)
equilibrium=$(cargo bench --locked --quiet -p anisobond --bench equilibrium)
cracked=$(cargo bench --locked --quiet -p anisobond --bench equilibrium -- 32 64 crack)
anisotropic=$(cargo bench --locked --quiet -p anisobond --bench equilibrium -- 32 64 KIO3 Te2W)
{
  cat <<'TEXT'
# Bodies on grids, measured

Written by `verification/bodies.sh`. Errors are against closed forms (`experiment::closed_forms`); times are of the machine
that ran it, ratios are measured in one run.

## Waves, bars and plates, patch test, beams, a pressurised hole

`cargo bench -p anisobond-app --bench bodies`.

```text
TEXT
  echo "$bodies"
  cat <<'TEXT'
```

## What the calibration of truncated neighbourhoods does, and what it cannot

`python verification/surface_rules.py`: rules for the bonds near a free face, on a slab that is periodic in its plane. Errors
are of the membrane stiffness, of the contraction (over the whole thickness, and over the middle layers), and of the bending
stiffness; the force is the largest on a layer in the exact strain, over the stress.

```text
TEXT
  echo "$rules"
  cat <<'TEXT'
```

A node's own calibration (`each end`, what `surface_calibration` does) restores the sum over all layers: the means of two ends
keep it, so the membrane's error falls. It does not balance single layers: in the exact strain the layers at
the face of this slab carry larger forces than without calibration (the table's last column), which self-equilibrate within a horizon
and bend the outermost layers. That is the error of the contraction over the whole thickness; it is first order in horizon over
thickness and stays out of the middle once the faces are more than two horizons apart. Asking that the means of both ends
reach the tensor at every node (`mean`) makes it worse: the tensor of a node is not its balance of forces. Asking for that
balance (`faces`: no force on inner layers, the traction on the outermost) and for the tensor's components in the plane makes
strains exact and the bending error small, with stiffnesses of 0.5 to 2.8 of the bulk's; with the half cell outside the outermost
nodes free of stress across the plane (`half cell`) the membrane is exact too and bending converges at second order. Both
hold on flat faces only: at edges, products or sums of the faces' factors left 1 to 3 % of contraction in bars of 8 to
16 nodes; edges need a solve of their own. Bodies keep `each end`.

## How many nodes a dimension needs

`python verification/coarse.py target/release/anisobond`. Stiffness in tension and bending, and contraction, over the closed form's, less 1. What `check` and
`run` name are the numbers of central bonds, with the smallest of the three horizons that is not below the body's; other Poisson's
ratios, anisotropy and bonds have others, as hybrid bonds show. A dash: no stiffness. A ligament between a hole and a face, or between the
tip of a crack and a face, is a strip. On a square grid radii of holes are as exact as the staircase lets them be, so errors do not
fall evenly.

```text
TEXT
  echo "$coarse"
  cat <<'TEXT'
```

Grains: the fine grid's own error is not in these numbers, and the nodes sample the volumes of forty grains to 1 %. What `check` and `run`
say of regions is of layers, which are farther off.

A plate one node thick has bonds in its plane alone: its calibration cannot reach the contraction. Plane strain with constants
E (1 + 2ν)/(1 + ν)² and ν/(1 + ν) and hybrid bonds is plane stress: a sheet of 144 × 72 nodes in tension had E and ν to −0.06 and +0.10 %
at ν = 0.25, −0.09 and +0.14 % at 1/3, −0.05 and +0.07 % at 0.2.

## Equilibrium of a block with a hole

`cargo bench -p anisobond --bench equilibrium`: horizon 3 spacings, held at the bottom, pulled at the top, to a relative
residual of 1e-8.

```text
TEXT
  echo "$equilibrium"
  cat <<'TEXT'
```

The same block without a hole, cut through six tenths of its section, and blocks with a hole of strongly anisotropic materials:

```text
TEXT
  echo "$cracked"
  echo "$anisotropic"
  echo '```'
} > docs/bodies.md.part
mv docs/bodies.md.part docs/bodies.md
