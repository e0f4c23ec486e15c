"""Prints the data sets of a universal file, as pyuff reads them, as JSON."""

import json
import sys

import pyuff

sets = pyuff.UFF(sys.argv[1]).read_sets()
print(
    json.dumps(
        [
            {
                "type": int(one["type"]),
                "func_type": int(one["func_type"]),
                "rsp_dir": int(one["rsp_dir"]),
                "ref_dir": int(one["ref_dir"]),
                "hz": [float(x) for x in one["x"]],
                "real": [float(y.real) for y in one["data"]],
                "imag": [float(y.imag) for y in one["data"]],
            }
            for one in sets
        ]
    )
)
