#!/usr/bin/python3
"""How thick may the wall of a floating duck be? Metacentric height and mass over the wall, as a plot.

    python3 wall_study.py [FOLDER]      writes wall_study.png there
"""
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # to a file, without a window
import matplotlib.pyplot as plt
import numpy as np
import rayrep


def main(folder):
    duck = rayrep.load(Path(__file__).parents[1] / "duck.stl")
    walls, heights, masses = [], [], []
    for wall in np.arange(0.8, 6.1, 0.8):
        try:
            result = rayrep.hollow(duck, "float", wall=wall, resolution=60)
        except rayrep.GoalError as error:
            print(f"{wall:.1f} mm: {error}")
            continue
        walls.append(wall)
        heights.append(result.figures["metacentric_height_mm"])
        masses.append(result.figures["mass_g"])
        print(f"{wall:.1f} mm: {masses[-1]:.1f} g, GM {heights[-1]:.2f} mm")

    figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 6), constrained_layout=True)
    above.plot(walls, heights, "o-")
    above.set_ylabel("metacentric height (mm)")
    below.plot(walls, masses, "o-")
    below.set_ylabel("mass (g)")
    below.set_xlabel("wall (mm)")
    figure.savefig(folder / "wall_study.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
