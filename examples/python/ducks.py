#!/usr/bin/python3
"""A batch of ducks, from small to large, two at a time: a mesh of each and a table.

    python3 ducks.py [FOLDER]      writes duck_40.stl ... and ducks.csv there

A run leaves Python to others while it computes, so threads do. Many thousands are for `rayrep batch` (docs/batches.md).
"""
import csv
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import rayrep

SIZES = (40, 60, 80, 100)  # longest side, mm


def main(folder):
    duck = rayrep.load(Path(__file__).parents[1] / "duck.stl")

    def one(size):
        try:
            result = rayrep.hollow(duck, "float", size=size, resolution=50, threads=1)
        except rayrep.GoalError as error:
            return {"size_mm": size, "result": str(error)}
        result.export(folder / f"duck_{size}.stl")
        figures = result.figures
        return {"size_mm": size, "result": "verified", "mass_g": round(figures["mass_g"], 3),
                "waterline_mm": round(figures["waterline_mm"], 3), "metacentric_height_mm": round(figures["metacentric_height_mm"], 3)}

    with ThreadPoolExecutor(2) as pool, open(folder / "ducks.csv", "w", newline="") as file:
        table = csv.DictWriter(file, ["size_mm", "result", "mass_g", "waterline_mm", "metacentric_height_mm"])
        table.writeheader()
        for row in pool.map(one, SIZES):
            table.writerow(row)
            print(row)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
