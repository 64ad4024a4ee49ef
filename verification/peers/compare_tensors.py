"""Compare what an engine measured with expected.csv: python compare_tensors.py FOLDER TOLERANCE [MEASURED].

MEASURED is a CSV of the stiffness (measured.csv by default), or CalculiX' .dat with the compliance.
"""

import csv
import re
import sys


def table(path):
    with open(path) as file:
        return [[float(x) for x in row] for row in list(csv.reader(file))[1:]]


def stiffness_of_dat(path):
    """Displacements of the two reference nodes in six steps are the columns of the compliance."""
    with open(path) as file:
        rows = [line.split() for line in file if re.match(r"\s+\d+\s+[-0-9]", line)]
    columns = [[float(x) for row in rows[2 * c : 2 * c + 2] for x in row[1:]] for c in range(6)]
    matrix = [[columns[j][i] for j in range(6)] + [float(i == j) for j in range(6)] for i in range(6)]
    for i in range(6):
        pivot = max(range(i, 6), key=lambda r: abs(matrix[r][i]))
        matrix[i], matrix[pivot] = matrix[pivot], matrix[i]
        matrix[i] = [x / matrix[i][i] for x in matrix[i]]
        for r in range(6):
            if r != i:
                factor = matrix[r][i]
                matrix[r] = [x - factor * y for x, y in zip(matrix[r], matrix[i])]
    return [row[6:] for row in matrix]


folder, tolerance = sys.argv[1], float(sys.argv[2])
name = sys.argv[3] if len(sys.argv) > 3 else "measured.csv"
read = stiffness_of_dat if name.endswith(".dat") else table
expected, measured = table(f"{folder}/expected.csv"), read(f"{folder}/{name}")
norm = sum(x * x for row in expected for x in row) ** 0.5
error = sum((x - y) ** 2 for e, m in zip(expected, measured) for x, y in zip(e, m)) ** 0.5 / norm
print(f"{folder}: relative error {error:.1e}")
sys.exit(0 if error <= tolerance else 1)
