"""What Spectral Python's own readers, and pyASDReader, make of the spectra in FOLDER, as JSON; and a library written there.

    python -W error read_libraries.py FOLDER
"""

import json
import os
import sys
import warnings

import numpy as np
from spectral.database.ecostress import read_ecostress_file
from spectral.database.usgs import SampleData, SpectrometerData
from spectral.io.envi import SpectralLibrary


def main(folder):
    found = {}
    ecostress = "concrete.spectrum.txt"
    signature = read_ecostress_file(os.path.join(folder, ecostress))
    assert "percent" in signature.measurement["y units"].lower()
    found[ecostress] = {"nm": [1e3 * x for x in signature.x], "value": [y / 100 for y in signature.y]}

    usgs = "splib07a_Quartz_GDS31_ASDFRa_AREF.txt"
    sample = SampleData.read_from_file(os.path.join(folder, usgs))
    wavelengths = "splib07a_Wavelengths_ASD_0.35-2.5_microns_2151_ch.txt"
    spectrometer = SpectrometerData.read_from_file(os.path.join(folder, wavelengths))
    pairs = [(1e3 * x, y) for x, y in zip(spectrometer.values, sample.values) if y > -1e30]
    found[usgs] = {"nm": [x for x, _ in pairs], "value": [y for _, y in pairs]}

    # It writes a log to where it is.
    os.chdir(folder)
    from pyASDReader import ASDFile

    leaf = ASDFile(os.path.join(folder, "leaf.asd"))
    with warnings.catch_warnings():
        # Of the way in which it divides.
        warnings.simplefilter("ignore", UserWarning)
        reflectance = leaf.reflectance
    found["leaf.asd"] = {"nm": leaf.wavelengths.tolist(), "value": reflectance.tolist()}

    nm = np.array([410.0, 520.5, 633.25, 790.125])
    data = np.array([[0.11, 0.22, 0.33, 0.44], [0.05, 0.06, 0.07, 0.09]], dtype=np.float32)
    names = ["dry soil", "wet soil"]
    header = {"wavelength": nm.tolist(), "wavelength units": "Nanometers", "spectra names": names}
    SpectralLibrary(data, header).save(os.path.join(folder, "written"), "made for a test")
    for name, spectrum in zip(names, data):
        found[f"written.sli: {name}"] = {"nm": nm.tolist(), "value": spectrum.astype(float).tolist()}
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1])
