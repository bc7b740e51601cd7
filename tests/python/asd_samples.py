"""Real files of ASD spectrometers, from the source distribution of pyASDReader, into FOLDER; what that makes of them, as JSON.

    asd_samples.py FOLDER

Of each file: the wavelengths in nm, the type of its spectrum, and its quotient by that of the white reference, which is the
reflectance that pyASDReader tells, or made here of the files' counts, of which it tells none.
Needs a registry of Python packages.
"""

import json
import pathlib
import subprocess
import sys
import tarfile
import warnings

SOURCE = "pyASDReader==1.2.3"


def quotient(file):
    with warnings.catch_warnings():
        # Of the way in which it divides.
        warnings.simplefilter("ignore", UserWarning)
        reflectance = file.reflectance
    return file.spectrumData.spectra / file.referenceData.spectra if reflectance is None else reflectance


def main(folder):
    folder = pathlib.Path(folder)
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    subprocess.run([*pip, "--no-binary", ":all:", "--dest", folder, SOURCE], check=True, stdout=sys.stderr)
    (archive,) = folder.glob("*.tar.gz")
    with tarfile.open(archive) as files:
        files.extractall(folder, filter="data")
    from pyASDReader import ASDFile

    found = {}
    for path in sorted(folder.glob("*/tests/sample_data/*/*.asd")):
        file = ASDFile(str(path))
        found[str(path)] = {
            "nm": file.wavelengths.tolist(),
            "type": file.metadata.dataType.name,
            "spectrum": file.spectrumData.spectra.tolist(),
            "quotient": quotient(file).tolist(),
        }
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1])
