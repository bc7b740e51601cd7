"""Every recipe of docs/interop.md, on every export that it is for, with the readers that people have.

    python -W error interop.py SPECTILE FOLDER [--channels 8,400] [--more]

Renders a cube of each number of channels into FOLDER, with a tile that is missing, exports it with the commands of the page, runs the
page's blocks of Python in the folder of the exports, and compares what they end with: values bit for bit, wavelengths, widths, names and
units. One line for each (reader, export, channels); the first difference ends it. `--more` makes two environments in FOLDER and does the
same in them: requirements-more.txt, and requirements-newest.txt, which needs Python 3.12 or newer.

What is right comes from the scene written here and from the cube's bytes as docs/cube.md describes them, through numpy alone.
"""

import argparse
import gc
import glob
import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import warnings

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
PAGE = os.path.join(HERE, "..", "..", "docs", "interop.md")
WIDTH, HEIGHT, TILE = 10, 9, 8

SCENE = """[camera.orthographic]
position = [0.0, 0.0, 5.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
width = 2.0
[film]
width = {width}
height = {height}
[channels]
intervals = {intervals}
[integrator]
# So that no path is left out, and no two pixels of one sample each are black.
evaluation = "all"
max_bounces = 1
[materials]
floor.diffuse.reflectance = {{ samples = [[380, 0.1], [2500, 0.9]] }}
lamp.black = {{}}
[[objects]]
quad = {{ corner = [-2.0, -2.0, 0.0], edge_u = [4.0, 0.0, 0.0], edge_v = [0.0, 4.0, 0.0] }}
material = "floor"
[[objects]]
sphere = {{ center = [0.6, -0.1, 0.4], radius = 0.1 }}
material = "lamp"
emission = {{ blackbody = 2856 }}
"""

# Where an export lies, in the folder of its channels, and what it is called there instead of what the recipe says.
ENVI = {"ENVI bil": ("", {}), "ENVI bsq": ("bsq", {}), "ENVI bip": ("bip", {})}
CUBE = {"the cube": ("", {})}
STORES = {**CUBE, "Zarr": ("", {"cube.zarr": "small.zarr"}), "Zarr without shards": ("", {"cube.zarr": "loose.zarr"})}
# GDAL before 3.13 knows no shards.
LOOSE = {name: STORES[name] for name in ("the cube", "Zarr without shards")}
OPENEXR = {"OpenEXR": ("", {})}
CSV = {"CSV": ("", {})}

CUBE_UNIT, ENVI_UNIT, EXR_UNIT = "W m-2 sr-1 nm-1", "W m^-2 sr^-1 nm^-1", "W.m^-2.sr^-1.nm^-1"

# Of a heading of the page: the package, the exports, the unit, and by how much wavelengths may be off, in nm: half of the last of the
# decimals that the format prints, and the rounding of a number of that size to f64 and back. 0 is: the same bits.
SIX_DECIMALS, THREE_DECIMALS = 0.5e-6 + 1e-12, 0.5e-3 + 1e-12
RECIPES = {
    "xarray": ("xarray", STORES, CUBE_UNIT, 0),
    "zarr": ("zarr", STORES, CUBE_UNIT, 0),
    "QGIS and GDAL": ("rasterio", ENVI, ENVI_UNIT, 0),
    "GDAL 3.12": ("rasterio", LOOSE, CUBE_UNIT, 0),
    "rioxarray": ("rioxarray", ENVI, ENVI_UNIT, 0),
    "Spectral Python": ("spectral", ENVI, ENVI_UNIT, 0),
    "MATLAB": ("numpy", ENVI, ENVI_UNIT, 0),
    "hyperspy": ("hyperspy", STORES, CUBE_UNIT, 0),
    "OpenEXR": ("OpenEXR", OPENEXR, EXR_UNIT, SIX_DECIMALS),
    "OpenImageIO": ("OpenImageIO", OPENEXR, EXR_UNIT, SIX_DECIMALS),
    "colour-science": ("colour-science", OPENEXR, None, SIX_DECIMALS),
    "pandas": ("pandas", CSV, None, THREE_DECIMALS),
    "netCDF": ("h5netcdf", STORES, CUBE_UNIT, 0),
}
# What a reader does not have of (width, names, unit), as the page's table says.
LOST = {
    "GDAL 3.12": {"width", "names"},
    "hyperspy": {"width", "names"},
    "OpenEXR": {"names"},
    "OpenImageIO": {"names"},
    "colour-science": {"width", "names", "unit"},
    "pandas": {"width", "unit"},
}
# Those that refuse files of more than 1,024 channels.
SPLIT = {"OpenImageIO", "colour-science"}

# Which recipes each environment has to run.
ENVIRONMENTS = {
    "requirements.txt": [name for name in RECIPES if name not in ("GDAL 3.12", "hyperspy", "netCDF")],
    "requirements-more.txt": ["xarray", "zarr", "hyperspy", "netCDF"],
    "requirements-newest.txt": ["xarray", "zarr", "QGIS and GDAL", "GDAL 3.12", "rioxarray"],
}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("spectile")
    parser.add_argument("folder")
    parser.add_argument("--channels", default="8,400")
    parser.add_argument("--more", action="store_true", help="other versions too, in environments of their own")
    parser.add_argument("--only-read", choices=ENVIRONMENTS, help="what an earlier call has written, as this environment")
    arguments = parser.parse_args()
    counts = [int(count) for count in arguments.channels.split(",")]
    # Python shows nobody these.
    warnings.simplefilter("ignore", PendingDeprecationWarning)
    blocks = read_page()
    if arguments.only_read:
        read_all(arguments.folder, counts, arguments.only_read, blocks)
        return
    spectile, folder = os.path.abspath(arguments.spectile), os.path.abspath(arguments.folder)
    os.makedirs(os.path.join(folder, "bin"), exist_ok=True)
    os.symlink(spectile, os.path.join(folder, "bin", "spectile"))
    os.environ["PATH"] = os.pathsep.join([os.path.join(folder, "bin"), os.path.dirname(sys.executable), os.environ["PATH"]])
    for count in counts:
        write(os.path.join(folder, str(count)), count, blocks)
    read_all(folder, counts, "requirements.txt", blocks)
    if arguments.more:
        more(folder, arguments.channels)


def read_page():
    """The page's blocks: of each heading, those of bash and the one of Python."""
    with open(PAGE, encoding="utf-8") as file:
        text = file.read()
    python, bash = {}, []
    for heading, language, block in re.findall(r"^#+ ([^\n]+)$|^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        if heading:
            under = heading
        elif language == "python":
            assert under not in python, f"two blocks of Python under {under}"
            python[under] = block
        elif language == "bash":
            bash.append(block)
    assert set(python) == set(RECIPES), f"recipes of the page: {sorted(python)}; known here: {sorted(RECIPES)}"
    assert bash[0].startswith("spectile export"), "the page begins with the exports"
    return python, bash


def intervals(count):
    """Channels that grow with their wavelength, with gaps, so that widths do not follow from centres."""
    ends = [380 * (2500 / 380) ** (i / count) for i in range(count + 1)]
    return [[round(low, 4), round(low + 0.75 * (high - low), 4)] for low, high in zip(ends, ends[1:])]


def call(words, folder):
    done = subprocess.run(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def write(folder, count, blocks):
    """A cube whose first tile is missing, and its exports as the page writes them; what the page does not write, beside them."""
    os.makedirs(folder)
    with open(os.path.join(folder, "scene.toml"), "w") as file:
        file.write(SCENE.format(width=WIDTH, height=HEIGHT, intervals=intervals(count)))
    size = ["--tile", str(TILE), "--tiles", "1..4"]
    call(["spectile", "render", "scene.toml", "-o", "cube.zarr", "--spp", "1", "--quiet", *size], folder)
    _, bash = blocks
    for block in bash:
        call(["bash", "-euc", block], folder)
    call(["spectile", "export", "cube.zarr", "-o", "loose.zarr", "--zarr-no-shards"], folder)
    for order in ("bsq", "bip"):
        os.makedirs(os.path.join(folder, order))
        call(["spectile", "export", "cube.zarr", "-o", f"{order}/cube.img", "--interleave", order], folder)
    os.makedirs(os.path.join(folder, "split"))
    if count > 1000:
        call(["spectile", "export", "cube.zarr", "-o", "split/spectral.exr", "--exr-split", "1000"], folder)
        call(["spectile", "export", "cube.zarr", "-o", "split/wide.exr", "--bands", "0..1022"], folder)


class Truth:
    """What is in a cube, from its bytes and from the scene."""

    def __init__(self, folder, count):
        bounds = intervals(count)
        self.wavelength = np.array([0.5 * (low + high) for low, high in bounds])
        self.width = np.array([high - low for low, high in bounds])
        cube = os.path.join(folder, "cube.zarr")
        with open(os.path.join(cube, "zarr.json"), encoding="utf-8") as file:
            self.names = json.load(file)["attributes"]["channel_names"]
        # Three decimals, and no two of the same name.
        assert len(set(self.names)) == count, "names of channels are not unique"
        for name, nm in zip(self.names, self.wavelength):
            assert abs(float(name.removesuffix(" nm")) - nm) <= THREE_DECIMALS, f"{name} is at {nm} nm"
        self.values = np.full((HEIGHT, WIDTH, count), np.nan, "<f4")
        for row in range(-(-HEIGHT // TILE)):
            for column in range(-(-WIDTH // TILE)):
                path = os.path.join(cube, "radiance", "c", "0", str(row), str(column))
                if os.path.exists(path):
                    tile = np.fromfile(path, "<f4").reshape(TILE, TILE, count).transpose(1, 0, 2)
                    part = self.values[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE]
                    part[:] = tile[: part.shape[0], : part.shape[1]]
        missing = np.isnan(self.values)
        # The first tile is missing, and nothing else; no two pixels look the same, so that none can be taken for another.
        assert missing[:TILE, :TILE].all() and missing.sum() == TILE * TILE * count, "not the tile that should be missing"
        spectra = self.values[~missing].reshape(-1, count)
        assert len(np.unique(spectra, axis=0)) == len(spectra), "two pixels have the same spectrum"


def read_all(folder, counts, environment, blocks):
    recipes, _ = blocks
    packages = sorted({RECIPES[name][0] for name in ENVIRONMENTS[environment]})
    print(f"{environment}: Python {sys.version.split()[0]}; " + ", ".join(f"{p} {importlib.metadata.version(p)}" for p in packages))
    if "rasterio" in packages:
        import rasterio

        print(f"{environment}: GDAL {rasterio.__gdal_version__}")
    with open(os.path.join(HERE, environment)) as file:
        for package, version in (line.strip().split("==") for line in file):
            there = importlib.metadata.version(package)
            assert there == version, f"{package} is {there}, and {environment} says {version}"
    for count in counts:
        here = os.path.join(folder, str(count))
        truth = Truth(here, count)
        for name in ENVIRONMENTS[environment]:
            _, exports, unit, tolerance = RECIPES[name]
            for export, (place, renamed) in exports.items():
                if name in SPLIT and count > 1000:
                    place = "split"
                text = recipes[name]
                for old, new in renamed.items():
                    assert old in text
                    text = text.replace(old, new)
                try:
                    compare(run(text, os.path.join(here, place)), truth, unit, tolerance, LOST.get(name, set()))
                except Exception as error:
                    sys.exit(f"{name}, {export}, {count} channels: {type(error).__name__}: {error}")
                print(f"{name}, {export}, {count} channels: right")
        for fact in FACTS[environment]:
            said = f"{fact.__name__.replace('_', ' ')}, {count} channels"
            try:
                fact(here, count)
            except Exception as error:
                sys.exit(f"{said}: not so: {type(error).__name__}: {error}")
            print(f"{said}: so it is")


def run(text, folder):
    """A recipe as the whole of a program in this folder, and what it ends with."""
    before, names = os.getcwd(), {"__name__": "__main__"}
    os.chdir(folder)
    try:
        with warnings.catch_warnings():
            exec(compile(text, "docs/interop.md", "exec"), names)
    finally:
        os.chdir(before)
    return names


def compare(got, truth, unit, tolerance, lost):
    for what in ("width", "names", "unit"):
        assert (what in got) == (what not in lost), f"{what} is there, or not, other than the page says"
    values = np.asarray(got["values"])
    assert values.dtype == np.float32, f"values are {values.dtype}"
    assert values.shape == truth.values.shape, f"{values.shape} values, and not {truth.values.shape}"
    missing = np.isnan(truth.values)
    assert np.array_equal(np.isnan(values), missing), "NaN is not where nothing is rendered"
    differ = np.ascontiguousarray(values).view(np.uint32) != np.ascontiguousarray(truth.values).view(np.uint32)
    where = np.argwhere(differ & ~missing)
    assert len(where) == 0, f"{len(where)} values differ, the first at row, column, channel {where[0]}"
    wavelength = np.asarray(got["wavelength"], np.float64)
    off = np.abs(wavelength - truth.wavelength).max()
    assert off <= tolerance, f"wavelengths are off by {off} nm"
    if "width" in got:
        off = np.abs(np.asarray(got["width"], np.float64) - truth.width).max()
        assert off == 0, f"widths are off by {off} nm"
    if "names" in got:
        assert list(got["names"]) == truth.names, "names differ"
    if "unit" in got:
        assert got["unit"] == unit, f"the unit is {got['unit']}, and not {unit}"


# What the page says of readers beside the recipes.


def open_quietly(name):
    import rasterio

    warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
    return rasterio.open(name)


def refused_by_gdal(name, words):
    import rasterio

    try:
        open_quietly(name).close()
    except rasterio.errors.RasterioIOError as error:
        assert words in str(error), error
    else:
        raise AssertionError(f"GDAL opens {name}")


def GDAL_stops_at_long_lines(folder, count):
    with open(os.path.join(folder, "cube.hdr")) as file:
        header = file.read()
    assert max(map(len, header.splitlines())) <= 120, "the header has long lines"
    joined = re.sub(r"\{[^}]*\}", lambda found: found[0].replace("\n", ""), header)
    path = os.path.join(folder, "long.img")
    shutil.copy(os.path.join(folder, "cube.img"), path)
    with open(os.path.join(folder, "long.hdr"), "w") as file:
        file.write(joined)
    line = next(line for line in joined.splitlines() if line.startswith("wavelength = "))
    with warnings.catch_warnings(), open_quietly(path) as image:
        seen = "wavelength" in image.tags(1)
    assert seen == (len(line) < 10_000), f"a line of {len(line)} characters: wavelengths are {'' if seen else 'not '}seen"


def GDAL_rounds_widths_to_nanometres(folder, count):
    truth = Truth(folder, count)
    with warnings.catch_warnings(), open_quietly(os.path.join(folder, "cube.img")) as image:
        for band in {1, count}:
            seen = image.tags(band, ns="IMAGERY")
            assert seen["FWHM_UM"] == f"{truth.width[band - 1] / 1000:.3f}", seen
            assert seen["CENTRAL_WAVELENGTH_UM"] == f"{truth.wavelength[band - 1] / 1000:.3f}", seen


def GDAL_calls_bands_by_name_and_wavelength(folder, count):
    truth = Truth(folder, count)
    with warnings.catch_warnings(), open_quietly(os.path.join(folder, "cube.img")) as image:
        for seen, name, nm in zip(image.descriptions, truth.names, truth.wavelength, strict=True):
            before, after = seen.split(" (")
            assert before == name and float(after.removesuffix(" Nanometers)")) == nm, seen
        assert image.nodata == -9999, image.nodata
        colours = [band for band, colour in zip(image.indexes, image.colorinterp) if colour.name in ("red", "green", "blue")]
        assert sorted(map(int, re.findall(r"\d+", image.tags(ns="ENVI")["default_bands"]))) == colours


def GDAL_without_OpenEXR_takes_it_for_ENVI(folder, count):
    beside = os.path.join(folder, "beside")
    os.makedirs(beside, exist_ok=True)
    shutil.copy(os.path.join(folder, "cube.hdr"), beside)
    shutil.copy(os.path.join(folder, "spectral.exr"), os.path.join(beside, "cube.exr"))
    with warnings.catch_warnings(), open_quietly(os.path.join(beside, "cube.exr")) as image:
        assert image.driver == "ENVI", image.driver


def GDAL_310_opens_no_Zarr(folder, count):
    for name in ("cube.zarr", "small.zarr", "loose.zarr"):
        refused_by_gdal(f'ZARR:"{folder}/{name}":/radiance', "Unsupported codec: ")


def GDAL_312_opens_no_shards(folder, count):
    # One chunk, and no shards.
    if count <= 64:
        open_quietly(f'ZARR:"{folder}/small.zarr":/radiance').close()
        return
    refused_by_gdal(f'ZARR:"{folder}/small.zarr":/radiance', "Unsupported codec: sharding_indexed")
    with warnings.catch_warnings(), open_quietly(os.path.join(folder, "small.zarr")) as image:
        assert image.shape == (count, 2), image.shape


def rioxarray_has_one_attribute_for_all_wavelengths(folder, count):
    import rioxarray

    with warnings.catch_warnings():
        open_quietly(os.path.join(folder, "cube.img")).close()
        with rioxarray.open_rasterio(os.path.join(folder, "cube.img"), masked=True) as image:
            assert float(image.attrs["wavelength"]) == Truth(folder, count).wavelength[0]
            one = image.swap_dims(band="wavelength").sel(wavelength=550, method="nearest")
            assert one.shape == (HEIGHT, WIDTH)


def SPy_and_others_leave_the_number(folder, count):
    import spectral

    image = spectral.open_image(os.path.join(folder, "cube.hdr"))
    assert (image.read_pixel(0, 0) == -9999).all()


def OpenImageIO_opens_1024_channels_a_file(folder, count):
    import OpenImageIO

    def opens(name):
        return OpenImageIO.ImageInput.open(os.path.join(folder, name)) is not None

    assert opens("spectral.exr") == (count + 3 <= 1024), OpenImageIO.geterror()
    if count > 1000:
        # With R, G and B one too many, unless more are allowed; more than 4,096 never are.
        assert not opens("split/wide.exr") and "limits:channels" in OpenImageIO.geterror()
        OpenImageIO.attribute("limits:channels", 4096)
        assert opens("split/wide.exr"), OpenImageIO.geterror()
        assert not opens("spectral.exr") and "does not support 5003-channel images" in OpenImageIO.geterror()
        OpenImageIO.attribute("limits:channels", 1024)


def hyperspy_opens_neither_by_itself(folder, count):
    import hyperspy.api

    hyperspy.api.set_log_level("CRITICAL")
    for name in ("cube.zarr", "cube.hdr"):
        try:
            with warnings.catch_warnings():
                # What it tries last, imageio, warns of itself, and leaves the file open.
                warnings.simplefilter("ignore")
                hyperspy.api.load(os.path.join(folder, name))
        except (ValueError, OSError):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                gc.collect()
            continue
        raise AssertionError(f"hyperspy opens {name}")


BOTH_GDALS = [
    GDAL_stops_at_long_lines,
    GDAL_rounds_widths_to_nanometres,
    GDAL_calls_bands_by_name_and_wavelength,
    GDAL_without_OpenEXR_takes_it_for_ENVI,
    rioxarray_has_one_attribute_for_all_wavelengths,
]
FACTS = {
    "requirements.txt": [
        *BOTH_GDALS,
        GDAL_310_opens_no_Zarr,
        SPy_and_others_leave_the_number,
        OpenImageIO_opens_1024_channels_a_file,
    ],
    "requirements-more.txt": [hyperspy_opens_neither_by_itself],
    "requirements-newest.txt": [*BOTH_GDALS, GDAL_312_opens_no_shards],
}


def more(folder, channels):
    """The same with other versions of readers."""
    for requirements, oldest in (("requirements-more.txt", (3, 11)), ("requirements-newest.txt", (3, 12))):
        base = python_from(oldest)
        if base is None:
            print(f"skipped: {requirements} needs Python {oldest[0]}.{oldest[1]} or newer, and there is none")
            continue
        venv = os.path.join(folder, requirements.removesuffix(".txt"))
        call([base, "-m", "venv", venv], folder)
        python = os.path.join(venv, "bin", "python")
        call([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "-r", os.path.join(HERE, requirements)], folder)
        sys.stdout.flush()
        again = [__file__, "spectile", folder, "--channels", channels, "--only-read", requirements]
        if subprocess.run([python, "-W", "error", *again]).returncode != 0:
            sys.exit(f"this is with {requirements}")


def python_from(oldest):
    """A Python that is new enough and can make an environment: this one, one in PATH, or one of pyenv's."""
    names = [sys.executable, *(shutil.which(f"python3.{minor}") for minor in (14, 13, 12, 11))]
    root = os.environ.get("PYENV_ROOT", os.path.expanduser("~/.pyenv"))
    names += sorted(glob.glob(os.path.join(root, "versions", "3.*", "bin", "python3")))
    for name in filter(None, names):
        # pyenv puts names into PATH that only say that they are not chosen.
        ask = f"import ensurepip, sys; sys.exit(sys.version_info < {oldest})"
        if subprocess.run([name, "-c", ask], stderr=subprocess.DEVNULL).returncode == 0:
            return name
    return None


if __name__ == "__main__":
    main()
