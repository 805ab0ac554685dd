"""Writes the map files of this folder: the same fluxes in each format that is read.

    pip install numpy scipy h5py
    python3 generate.py

The fluxes are a formula that the tests know; both axes have different lengths, so that a transposed reading shows.
"""

import h5py
import numpy as np
from scipy.io import savemat

i_d = np.linspace(-6.0, 6.0, 7)
i_q = np.linspace(-4.0, 4.0, 5)


def fluxes(d, q):
    psi_d = 0.45 + 0.0106 * d - 2e-5 * d**2 - 4e-5 * q**2
    psi_q = 0.0169 * q - 8e-5 * d * q
    return psi_d, psi_q


# NumPy: axes with the first index i_d; meshes, compressed, Fortran order and single precision.
d, q = np.meshgrid(i_d, i_q, indexing="ij")
psi_d, psi_q = fluxes(d, q)
np.savez("axes.npz", i_d_A=i_d, i_q_A=i_q, psi_d_Wb=psi_d, psi_q_Wb=psi_q)
np.savez("transposed.npz", i_d_A=i_d, i_q_A=i_q, psi_d_Wb=psi_d.T, psi_q_Wb=psi_q.T)
np.savez_compressed(
    "meshes.npz",
    i_d=np.asfortranarray(d),
    i_q=np.asfortranarray(q.astype(np.int32)),
    psi_d=np.asfortranarray(psi_d),
    psi_q=np.asfortranarray(psi_q.astype(">f8")),
)
# As motulator has them: complex numbers, d + j q.
np.savez("dq.npz", i_s_dq=np.asfortranarray(d + 1j * q), psi_s_dq=psi_d + 1j * psi_q)
broken = psi_d.copy()
broken[2, 3] = np.nan
np.savez("nan.npz", i_d_A=i_d, i_q_A=i_q, psi_d_Wb=broken, psi_q_Wb=psi_q)
np.savez("complex.npz", i_d_A=i_d, i_q_A=i_q, psi_d_Wb=psi_d + 0j, psi_q_Wb=psi_q)

# MATLAB: meshgrid(Id, Iq) has i_q along the rows.
d, q = np.meshgrid(i_d, i_q)
psi_d, psi_q = fluxes(d, q)
flat = {"Id": d, "Iq": q, "Fd": psi_d, "Fq": psi_q}
savemat("flat_v5.mat", flat, do_compression=False)
model = {
    "data": {"motorName": "test", "p": 3.0, "Rs": 0.55},
    "FluxMap_dq": {"Id": d, "Iq": q, "Fd": psi_d, "Fq": psi_q, "T": 0 * d},
}
savemat("model_v7.mat", {"motorModel": model, "flag": np.array([True])}, do_compression=True)
savemat("axes_v7.mat", {**flat, "Id": i_d, "Iq": i_q}, do_compression=True)
savemat("other.mat", {"x": d})
savemat("part.mat", {"Id": d, "Fd": psi_d})


# Version 7.3 is HDF5 behind 512 bytes of text, with each matrix transposed and each structure a group.
with h5py.File("model_v73.mat", "w", userblock_size=512) as file:
    group = file.create_group("motorModel")
    group.attrs["MATLAB_class"] = np.bytes_("struct")
    for name, fields in model.items():
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, value in fields.items():
            if isinstance(value, str):
                continue
            value = np.atleast_2d(np.asarray(value, dtype=float))
            data = inner.create_dataset(field, data=value.T, compression="gzip")
            data.attrs["MATLAB_class"] = np.bytes_("double")
with open("model_v73.mat", "r+b") as file:
    text = b"MATLAB 7.3 MAT-file, Platform: GLNXA64"
    file.write(text.ljust(116) + bytes(8) + b"\x00\x02IM")
