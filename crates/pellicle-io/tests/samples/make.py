"""Makes the HDF5 samples beside this file: the particles of common/samples.rs, as h5py 3.16 (HDF5 1.14) writes them."""

from pathlib import Path

import h5py
import numpy as np

HERE = Path(__file__).parent
i = np.arange(40)
positions = np.stack([i * 0.25, 1 - i * 0.5, (i % 7) * 0.125], 1).astype("f4")
velocity = np.stack([-i, 0 * i + 0.5, 2 * i], 1).astype("f4")
density = (1000 + i).astype("f4")

# Old structures: symbol tables, headers without checksums, chunks in a B-tree; and a dataset in one piece.
with h5py.File(HERE / "snapshot.hdf5", "w", libver="earliest") as file:
    gas = file.create_group("PartType0")
    gas.create_dataset("Coordinates", data=positions)
    gas.create_dataset("Velocities", data=velocity, chunks=(16, 3), compression="gzip", shuffle=True)
    gas.create_dataset("density", data=density.astype(">f8"), chunks=(16,), compression="gzip", fletcher32=True)
    file.create_group("PartType1")["Coordinates"] = positions[:3] + 100

# New structures, and steps of which the first has the particles, in two parts.
with h5py.File(HERE / "steps.vtkhdf", "w", libver="latest") as file:
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = [2, 0]
    root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", 8))
    more = np.full((2, 3), 9, "f4")
    root.create_dataset("Points", data=np.concatenate([positions, more]), chunks=(16, 3), maxshape=(None, 3), compression="gzip")
    root["NumberOfPoints"] = [30, 10, 2]
    data = root.create_group("PointData")
    data.create_dataset("velocity", data=np.concatenate([velocity, more]), chunks=(16, 3), maxshape=(None, 3))
    data["density"] = np.concatenate([density, [7, 7]]).astype("f4")
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = 2
    steps["Values"] = [0.0, 0.5]
    steps["PartOffsets"] = [0, 2]
    steps["NumberOfParts"] = [2, 1]
    steps["PointOffsets"] = [0, 40]
    steps.create_group("PointDataOffsets")["velocity"] = [0, 40]
