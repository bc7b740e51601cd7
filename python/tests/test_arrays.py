"""Arrays where a scene file would have tables or files: the same scenes, to the digest."""

import numpy
import pytest
import xarray
from conftest import ball

import spectile as sp

PAINT = numpy.array([[380, 0.05], [500, 0.1], [600, 0.7], [780, 0.8]])


@pytest.mark.parametrize(
    "paint",
    [
        PAINT,
        PAINT.astype(object).astype(float)[::1].copy(order="F"),
        (PAINT[:, 0], PAINT[:, 1]),
        (PAINT[:, 0].tolist(), PAINT[:, 1].tolist()),
        (PAINT[:, 0], PAINT[:, 1].tolist()),
        dict(PAINT.tolist()),
        {"samples": PAINT},
        {"samples": [tuple(row) for row in PAINT]},
        xarray.DataArray(PAINT[:, 1], coords={"wavelength": PAINT[:, 0]}, dims="wavelength"),
        xarray.DataArray(
            PAINT[:, 1], coords={"wavelength": ("wavelength", PAINT[:, 0], {"units": "Nanometres"})}, dims="wavelength"
        ),
        xarray.DataArray(
            PAINT[:, 1], coords={"wavelength": ("wavelength", PAINT[:, 0] / 1000, {"units": "um"})}, dims="wavelength"
        ),
    ],
    ids="array fortran pair lists mixed mapping samples tuples xarray nanometres micrometres".split(),
)
def test_spectra_in_every_way_are_one_scene(paint):
    scene = ball()
    scene["spectra"]["paint"] = paint
    in_place = ball()
    in_place["materials"]["ball"]["diffuse"]["reflectance"] = paint
    if isinstance(paint, xarray.DataArray) and paint.wavelength.attrs.get("units") == "um":
        # 0.38 um is 380 nm but for the last bit.
        assert scene.check() | {"digest": ""} == ball().check() | {"digest": ""}
    else:
        assert scene.digest == in_place.digest == ball().digest


def test_series_of_pandas_are_spectra():
    pandas = pytest.importorskip("pandas")
    scene = ball()
    scene["spectra"]["paint"] = pandas.Series(PAINT[:, 1], index=PAINT[:, 0])
    assert scene.digest == ball().digest


def test_numbers_of_numpy_are_numbers():
    scene = ball(film={"width": numpy.int32(16), "height": numpy.uint8(16)})
    scene["camera"]["perspective"]["position"] = numpy.array([0, -4, 1.5], numpy.float32)
    scene["camera"]["perspective"]["fov"] = numpy.float32(40)
    assert scene.digest == ball().digest
    scene["channels"] = {"intervals": numpy.array([[400, 500], [500, 700]])}
    assert scene.check()["bounds_nm"] == [[400.0, 500.0], [500.0, 700.0]]


# Readers of OBJ files number vertices as faces name them for the first time: so does this.
TETRAHEDRON = {
    "vertices": numpy.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]], float),
    "faces": numpy.array([[0, 1, 2], [0, 2, 3], [2, 1, 3], [0, 3, 1]]),
}


def obj(mesh, path):
    """The same mesh as a file."""
    corner = lambda i, j: "/".join(
        str(v) for v in (mesh["faces"][i][j] + 1, 3 * i + j + 1 if "uv" in mesh else "", 3 * i + j + 1 if "normals" in mesh else "")
    )
    at = lambda key, i, j: mesh[key][i][j] if mesh[key].ndim == 3 else mesh[key][mesh["faces"][i][j]]
    lines = ["v " + " ".join(map(repr, vertex)) for vertex in mesh["vertices"].tolist()]
    for key, word in (("uv", "vt"), ("normals", "vn")):
        if key in mesh:
            lines += [f"{word} " + " ".join(map(repr, at(key, i, j).tolist())) for i in range(len(mesh["faces"])) for j in range(3)]
    lines += ["f " + " ".join(corner(i, j) for j in range(3)) for i in range(len(mesh["faces"]))]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


@pytest.mark.parametrize("extra", ["", "uv", "uv by corner", "normals"])
def test_meshes_are_those_of_files(tmp_path, extra):
    mesh, numbers = dict(TETRAHEDRON), numpy.random.default_rng(1)
    texture = numpy.linspace(0, 1, 2 * 4 * 3, dtype=numpy.float32).reshape(2, 4, 3)
    if extra.startswith("uv"):
        mesh["uv"] = numbers.random((4, 3, 2) if "corner" in extra else (4, 2))
    if extra == "normals":
        mesh["normals"] = mesh["vertices"] - 0.25
    scene = ball()
    scene["objects"].append({"mesh": mesh, "material": "ball"})
    if extra.startswith("uv"):
        scene["materials"]["ball"] = {"diffuse": {"reflectance": {"texture": texture}}}
        scene["objects"][1]["material"] = "floor"
    digest = scene.check()["digest"]
    scene["objects"][-1]["mesh"] = obj(mesh, tmp_path / "mesh.obj")
    assert scene.check()["digest"] == digest
    moved = {**mesh, "vertices": mesh["vertices"] * 1.5}
    scene["objects"][-1]["mesh"] = moved
    assert scene.check()["digest"] != digest


def test_textures_and_grids_are_those_of_files(tmp_path):
    import OpenEXR

    numbers = numpy.random.default_rng(2)
    picture = numbers.random((5, 7, 3), dtype=numpy.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": picture}).write(str(tmp_path / "picture.exr"))
    OpenEXR.File(header, {"Y": picture[:, :, 0].copy()}).write(str(tmp_path / "weight.exr"))
    grid = numbers.random((2, 3, 4)) * 1000
    xarray.DataArray(grid.astype("f4"), dims=("z", "y", "x"), name="t").to_dataset().to_zarr(
        tmp_path / "t.zarr", zarr_format=3, consolidated=False
    )

    def scene(colour, weight, temperature):
        return ball(
            materials={
                "floor": {"diffuse": {"reflectance": {"texture": colour}}},
                "ball": {"blend": {"a": "floor", "b": "lamp", "weight": {"texture": weight, "filter": "nearest"}}},
                "lamp": {"black": {}},
            },
            media={"gas": {"absorption": 0.1, "temperature": {"grid": temperature}}},
            objects=[*ball()["objects"], {"cube": {"min": [1, 1, 1], "max": [2, 2, 2]}, "interior": "gas"}],
        )

    files = scene(str(tmp_path / "picture.exr"), str(tmp_path / "weight.exr"), str(tmp_path / "t.zarr/t"))
    weight = picture[::-1, ::-1][::-1, ::-1, 0]  # strides, and no channel
    arrays = scene(picture, weight, grid)
    assert arrays.digest == files.digest
    assert scene(picture.astype(float), weight[:, :, None], grid).digest == files.digest
    assert scene(picture * numpy.float32(0.5), weight, grid).digest != files.digest


def test_axes_by_name_are_put_in_order():
    picture = numpy.linspace(0, 1, 2 * 4 * 3, dtype=numpy.float32).reshape(2, 4, 3)
    named = xarray.DataArray(picture, dims=("y", "x", "channel"))

    def digest(texture):
        return ball(materials={**ball()["materials"], "floor": {"diffuse": {"reflectance": {"texture": texture}}}}).digest

    assert digest(named.transpose("channel", "x", "y")) == digest(named) == digest(picture) == digest(picture.astype(">f8"))
    packed = numpy.zeros((2, 4, 3), numpy.dtype([("pad", "u1"), ("value", "f4")]))
    packed["value"] = picture
    assert digest(packed["value"]) == digest(picture)


POSITIONS = numpy.array([[0.5, 0, 0.25], [-1, 1, 0.1], [1, 1, 0.3]])
TURNED = {**dict(zip("xyz", POSITIONS.T)), "yaw_degrees": numpy.array([0, 30.5, 200]), "scale": numpy.array([1, 0.5, 2], "f4")}


def posts(placements, **more):
    """A ball among posts, which stand where they are placed."""
    post = {"objects": [{"cube": {"min": [-0.1, -0.1, 0], "max": [0.1, 0.1, 1]}, "material": "floor"}]}
    return ball(assemblies={"post": post}, instances=[{"assembly": "post", "placements": placements, **more}])


def test_placements_are_those_of_files(tmp_path):
    pandas = pytest.importorskip("pandas")
    rows = zip(*(column.tolist() for column in TURNED.values()))
    (tmp_path / "posts.csv").write_text(",".join(TURNED) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    digest = posts(tmp_path / "posts.csv", up=[0, 0, 1]).digest
    records = numpy.rec.fromarrays(list(TURNED.values()), names=list(TURNED))
    for placements in (TURNED, pandas.DataFrame(TURNED), records, {name: list(column) for name, column in TURNED.items()}):
        assert posts(placements, up=[0, 0, 1]).digest == digest
    assert posts(TURNED).digest != digest
    matrices = numpy.tile(numpy.eye(4), (3, 1, 1))
    matrices[:, :3, 3] = POSITIONS
    shifted = posts(POSITIONS, transform={"translate": [0, 0, 0.5]})
    assert posts(POSITIONS).digest == posts(matrices).digest == posts(matrices[:, :3]).digest == posts(POSITIONS.tolist()).digest
    assert posts(POSITIONS + [0, 0, 0.5]).digest == shifted.digest != posts(POSITIONS).digest


@pytest.mark.parametrize(
    "placements, words",
    [
        (POSITIONS[:, :2], r"shape \[3, 2\]"),
        (POSITIONS * numpy.nan, "NaN as `x` of row 0"),
        (numpy.ones((2, 4, 4)), "last row"),
        ({"x": POSITIONS[:, 0]}, "no column y, z"),
        ({**TURNED, "x": [1.0]}, "different shapes"),
        ({**TURNED, "roll": TURNED["scale"]}, "`roll`"),
        ({**TURNED, "scale": [1, 0, 1]}, "row 1, counted from 0, flattens"),
        (POSITIONS * 1e20, "row 0, counted from 0, reaches beyond"),
        (POSITIONS[:0], "places nothing"),
        ({}, "no columns"),
        (None, "NoneType"),
        (3, "must be a string"),
    ],
)
def test_wrong_placements_are_refused(placements, words):
    with pytest.raises(sp.SceneError, match=words) as caught:
        posts(placements).check()
    assert caught.value.key == "instances.0.placements"


def test_mixtures_take_channels_in_order(tmp_path):
    shares = numpy.full((2, 2, 2), 0.5, numpy.float32)
    scene = ball()
    scene["materials"]["floor"]["diffuse"]["reflectance"] = {"texture": shares, "endmembers": ["paint", 0.25]}
    assert scene.check()["warnings"] == []


@pytest.mark.parametrize(
    "change, key, words",
    [
        (lambda s: s["spectra"].update(paint=PAINT[::-1]), "spectra.paint.samples.1", "ascend"),
        (lambda s: s["spectra"].update(paint=(PAINT[:, 0], PAINT[:3, 1])), "spectra.paint", "one value for each wavelength"),
        (lambda s: s["spectra"].update(paint=PAINT.astype(complex)), "spectra.paint", "must hold numbers"),
        (
            lambda s: s["spectra"].update(
                paint=xarray.DataArray(PAINT, dims=("wavelength", "y"), coords={"wavelength": PAINT[:, 0]})
            ),
            "spectra.paint",
            "choose one",
        ),
        (
            lambda s: s["spectra"].update(
                paint=xarray.DataArray([1.0], dims="wavelength", coords={"wavelength": ("wavelength", [1.0], {"units": "eV"})})
            ),
            "spectra.paint",
            "eV",
        ),
        (lambda s: s["objects"][0].update(mesh=numpy.zeros((3, 3))), "objects.0.mesh", "must not be an array"),
        (lambda s: s["objects"].append({"mesh": {"vertices": PAINT}, "material": "ball"}), "objects.3.mesh.faces", "missing"),
        (
            lambda s: s["objects"].append({"mesh": {**TETRAHEDRON, "normal": 1}, "material": "ball"}),
            "objects.3.mesh.normal",
            "unknown key",
        ),
        (
            lambda s: s["objects"].append({"mesh": {**TETRAHEDRON, "faces": TETRAHEDRON["faces"] + 1}, "material": "ball"}),
            "objects.3.mesh",
            "counted from 0",
        ),
        (
            lambda s: s["objects"].append({"mesh": {**TETRAHEDRON, "faces": TETRAHEDRON["faces"] - 1}, "material": "ball"}),
            "objects.3.mesh.faces",
            "counted from 0",
        ),
        (
            lambda s: s["objects"].append({"mesh": {**TETRAHEDRON, "faces": TETRAHEDRON["faces"] * 1.0}, "material": "ball"}),
            "objects.3.mesh.faces",
            "whole numbers",
        ),
        (
            lambda s: s["objects"].append(
                {"mesh": {**TETRAHEDRON, "vertices": TETRAHEDRON["vertices"] * numpy.nan}, "material": "ball"}
            ),
            "objects.3.mesh",
            "not finite",
        ),
        (
            lambda s: s["objects"].append({"mesh": {**TETRAHEDRON, "uv": numpy.zeros((3, 2))}, "material": "ball"}),
            "objects.3.mesh",
            "`uv` has 3",
        ),
        (
            lambda s: s["objects"].append({"mesh": {**TETRAHEDRON, "uv": numpy.zeros((4, 3))}, "material": "ball"}),
            "objects.3.mesh",
            "shape",
        ),
        (
            lambda s: s["objects"].append({"mesh": {**TETRAHEDRON, "faces": numpy.zeros((0, 3), int)}, "material": "ball"}),
            "objects.3.mesh",
            "no faces",
        ),
        (
            lambda s: s["materials"]["floor"]["diffuse"].update(reflectance={"texture": numpy.zeros((2, 2, 3), numpy.uint8)}),
            "materials.floor.diffuse.reflectance.texture",
            "what 1 is",
        ),
        (
            lambda s: s["materials"]["floor"]["diffuse"].update(reflectance={"texture": numpy.full((2, 2, 3), 1.5)}),
            "materials.floor.diffuse.reflectance.texture",
            "1.5",
        ),
        (
            lambda s: s["materials"]["floor"]["diffuse"].update(reflectance={"texture": numpy.full((2, 2, 3), numpy.nan)}),
            "materials.floor.diffuse.reflectance.texture",
            "NaN",
        ),
        (
            lambda s: s["materials"]["floor"]["diffuse"].update(reflectance={"texture": numpy.zeros((2, 0, 3))}),
            "materials.floor.diffuse.reflectance.texture",
            "no picture",
        ),
        (
            lambda s: s["materials"]["floor"]["diffuse"].update(reflectance={"texture": numpy.zeros((2, 2, 2))}),
            "materials.floor.diffuse.reflectance.texture",
            "2 channels",
        ),
    ],
)
def test_wrong_arrays_are_refused_by_key(change, key, words):
    scene = ball()
    change(scene)
    with pytest.raises(sp.SceneError) as caught:
        scene.check()
    assert caught.value.key == key and words in str(caught.value), str(caught.value)


def labelled(values, nm=PAINT[:, 0], name=None, **attributes):
    return xarray.DataArray(values, coords={"wavelength": nm}, dims="wavelength", attrs=attributes, name=name)


def refused(scene):
    with pytest.raises(sp.SceneError) as caught:
        scene.check()
    return str(caught.value)


def test_what_arrays_say_of_their_values_counts_as_in_files():
    paint = PAINT[:, 1]
    series = [pandas.Series(100 * paint, index=PAINT[:, 0], name="Reflectance (%)")] if (pandas := optional("pandas")) else []
    for percent in [labelled(100 * paint, units="%"), labelled(100 * paint, name="paint", long_name="% reflectance"), *series]:
        scene = ball()
        scene["spectra"]["paint"] = percent
        # 100 times a number, and a hundredth of that, is it but for the last bit.
        assert scene.check() | {"digest": ""} == ball().check() | {"digest": ""}
    # Powers of two, so that no bit differs.
    nm = numpy.array([256.0, 512.0, 1024.0])
    plain = ball(environment={"radiance": (nm, numpy.array([1.0, 2.0, 3.0]))})
    for units, factor in [("W m-2 sr-1 nm-1", 1.0), ("mW m-2 sr-1 nm-1", 1e3), ("W/m^2/sr/um", 1e3), ("uW cm-2 sr-1 nm-1", 1e2)]:
        scene = ball(environment={"radiance": labelled(factor * numpy.array([1.0, 2.0, 3.0]), nm, "L", units=units)})
        assert scene.digest == plain.digest, units
    for array, words in [
        (labelled(paint, units="W m-2"), "not that of a reflectance"),
        (labelled(paint, long_name="leaf transmittance"), "calls its values `leaf transmittance`, a transmittance"),
        (labelled(paint, name="log10_reflectance"), "logarithms"),
    ]:
        scene = ball()
        scene["spectra"]["paint"] = array
        assert words in refused(scene)
    # What is meant as it is, says so.
    scene["spectra"]["paint"] = {"samples": labelled(paint, long_name="leaf transmittance"), "scale": 1}
    assert any("times `scale`" in warning for warning in scene.check()["warnings"])
    air = ball()
    air["spectra"]["paint"] = labelled(
        paint, xarray.DataArray(PAINT[:, 0], dims="wavelength", attrs={"long_name": "wavelength in air"})
    )
    assert any("converted to vacuum" in warning for warning in air.check()["warnings"])
    with pytest.raises(sp.SceneError, match="reflectance .%.`, which is not heeded here"):
        ball().check({"spectra.paint": labelled(100 * paint, name="reflectance", units="%")})
    # A name that says nothing is no hindrance.
    assert ball().check({"spectra.paint": labelled(paint, name="oak")})["digest"] == ball().digest


def optional(name):
    try:
        return __import__(name)
    except ImportError:
        return None


def test_what_grids_and_textures_say_of_their_numbers_counts():
    def heat(grid):
        body = {"cube": {"min": [-0.1, -0.1, 1.2], "max": [0.1, 0.1, 1.4]}, "interior": "gas"}
        scene = ball(media={"gas": {"absorption": 0.5, "temperature": {"grid": grid}}})
        scene["objects"].append(body)
        return scene

    # 0.25 K steps are exact in floats of 32 bits.
    kelvin = numpy.arange(8.0).reshape(2, 2, 2) / 4 + 300.15
    dims = ("z", "y", "x")
    plain = heat(kelvin.astype("f4"))
    celsius = xarray.DataArray(kelvin - 273.15, dims=dims, attrs={"units": "degC"})
    assert heat(celsius).check()["digest"] == plain.digest
    assert any("converted to K" in warning for warning in heat(celsius).check()["warnings"])
    named = xarray.DataArray(kelvin - 273.15, dims=dims, attrs={"long_name": "Temperature (C)"})
    assert heat(named).digest == plain.digest
    # Heights that descend, and depths that ascend, are turned round.
    down = xarray.DataArray(kelvin[::-1], dims=dims, coords={"z": [1.5, 0.5]})
    depth = xarray.DataArray(kelvin[::-1], dims=dims, coords={"z": ("z", [0.5, 1.5], {"positive": "down"})})
    assert heat(down).digest == heat(depth).digest == plain.digest
    uneven = xarray.DataArray(numpy.repeat(kelvin, 2, 0)[:3], dims=dims, coords={"z": [0.0, 1.0, 3.0]})
    assert "not evenly spaced" in refused(heat(uneven))
    assert "is in `Pa`" in refused(heat(celsius.assign_attrs(units="Pa")))
    picture = xarray.DataArray(numpy.full((2, 2), 0.5), dims=("y", "x"), attrs={"units": "%"})
    scene = ball()
    scene["materials"]["ball"] = {"diffuse": {"reflectance": {"texture": picture}}}
    assert "gives its numbers in `%`" in refused(scene)
    scene["materials"]["ball"] = {"black": {"temperature": {"texture": (picture + 26.65).assign_attrs(units="degC")}}}
    assert any("converted to K" in warning for warning in scene.check()["warnings"])


def test_what_is_masked_infinite_or_has_a_unit_is_refused():
    masked = numpy.ma.masked_less(PAINT, 390)

    class Quantity:
        magnitude, units, ndim = PAINT, "um", 2

    nm, values = PAINT.T
    packed = xarray.DataArray(values, coords={"wavelength": nm}, dims="wavelength", attrs={"scale_factor": 1e-4})
    bare = xarray.DataArray(values, dims="wavelength")
    cases = [
        (masked, "masked"),
        (Quantity(), "unit of its own"),
        (packed, "attribute `scale_factor`"),
        (bare, "no coordinate `wavelength`"),
    ]
    try:
        import pint
    except ImportError:
        pass
    else:
        of_pint = (nm / 1000 * pint.UnitRegistry().um, values)
        cases += [
            (of_pint, "unit of its own, micrometer"),
            (bare.assign_coords(wavelength=nm).copy(data=values * pint.UnitRegistry().W), "unit of its own"),
        ]
    for paint, words in cases:
        scene = ball()
        scene["spectra"]["paint"] = paint
        with pytest.raises(sp.SceneError, match=words):
            scene.check()
    scene = ball()
    scene["materials"]["floor"]["diffuse"]["reflectance"] = {"texture": numpy.full((2, 2), 1e300)}
    with pytest.raises(sp.SceneError, match="inf"):
        scene.check()


def test_grids_of_wrong_shape_and_sign():
    for grid, words in (
        (numpy.zeros((2, 2)), "dimensions"),
        (numpy.full((1, 1, 1), -5.0), "not negative"),
        (numpy.full((1, 1, 1), numpy.inf), "inf"),
        (numpy.zeros((0, 1, 1)), "voxels"),
    ):
        scene = ball(media={"gas": {"absorption": 0.1, "density": {"grid": grid}}})
        scene["objects"].append({"cube": {"min": [1, 1, 1], "max": [2, 2, 2]}, "interior": "gas"})
        with pytest.raises(sp.SceneError, match=words) as caught:
            scene.check()
        assert caught.value.key == "media.gas.density.grid"


def test_arrays_resume_as_files_do(tmp_path):
    scene = ball()
    scene["objects"].append({"mesh": dict(TETRAHEDRON), "material": "ball"})
    sp.render(scene, tmp_path / "cube.zarr", spp=2)
    assert int(sp.render(scene, tmp_path / "cube.zarr", spp=4, resume=True).samples.max()) == 4
    scene["objects"][-1]["mesh"]["vertices"] = TETRAHEDRON["vertices"] * 2
    with pytest.raises(sp.SpectileError, match="scene"):
        sp.render(scene, tmp_path / "cube.zarr", spp=8, resume=True)
