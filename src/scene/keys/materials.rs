//! What surfaces do with light.

use super::Kind::{Boolean, Choice, File, List, Name, Number, Refused, Spectrum, Table};
use super::{CELSIUS, Key, Section};
use crate::scene::Quantity;

pub static MATERIAL: Section = Section {
    path: "materials.NAME",
    heading: "`[materials.NAME.KIND]`",
    summary: "what a surface does with light",
    about: "A material has one of six kinds. Objects name it, and so do `usemtl` lines of OBJ files and materials of glTF files.",
    keys: &[
        Key::one_of("diffuse", Table, "Lambert's law.").tables(&[&DIFFUSE]),
        Key::one_of("conductor", Table, "A metal, smooth, rough or brushed.").tables(&[&CONDUCTOR]),
        Key::one_of("dielectric", Table, "The boundary of glass, water, a crystal.").tables(&[&DIELECTRIC]),
        Key::one_of("plastic", Table, "A diffuse base under a clear coat: plastic, varnish, glazed tiles.")
            .tables(&[&PLASTIC]),
        Key::one_of("blend", Table, "Two materials, each with a share.").tables(&[&BLEND]),
        Key::one_of("black", Table, "Absorbs everything: what lamps are made of.").tables(&[&BLACK]),
    ],
    later: &[],
    at: "materials.paint",
    examples: &[A_DIFFUSE, A_CONDUCTOR, A_DIELECTRIC, A_PLASTIC, A_BLEND, A_BLACK],
    notes: "The *front* of a surface is the side that its geometric normal points to: see [Objects](#objects) for \
            each shape. Roughness is the α of the GGX distribution; below 0.001 a surface is smooth. Directions that \
            lie on the wrong side of the triangle itself, whatever its interpolated normals say, get no light.",
};

/// What may stand in the place of a number, and of a reflectance.
const NUMBERS: &[&Section] = &[&TEXTURE_OF_NUMBERS];
const COLOURS: &[&Section] = &[&TEXTURE];

const TWO_SIDED: Key =
    Key::default("two_sided", Boolean, "true", "Whether the back scatters as the front does; if not, it is black.");
const TEMPERATURE: Key = Key::optional(
    "temperature",
    Number,
    "emits no heat",
    "The surface emits Planck's radiance at this temperature as much as it absorbs, at each wavelength, angle and \
     place, on both sides. It adds to an object's `emission`.",
)
.or(CELSIUS)
.unit("K")
.range("(0, 1e9]")
.tables(NUMBERS);
const OPACITY: Key = Key::default(
    "opacity",
    Number,
    "1.0",
    "The share of rays that meet the surface; the others pass as if it were not there, which is no bounce. What it emits, by \
     `emission` and by heat, is less by the same share. A mask of 0 and 1 cuts leaves and fences out.",
)
.range("[0, 1]")
.tables(NUMBERS);
const REFLECTANCE: Key = Key::required(
    "reflectance",
    Spectrum(Quantity::Reflectance),
    "The share of light that is scattered, the same in all directions.",
)
.tables(COLOURS);
const EMISSIVITY: Key = Key::required(
    "emissivity",
    Spectrum(Quantity::Emissivity),
    "What is emitted of what a black body emits, and absorbed of what arrives: the rest is scattered. In the place of \
     `reflectance`.",
)
.unless("`reflectance`");
const TRANSMITTANCE: Key = Key::optional(
    "transmittance",
    Spectrum(Quantity::Transmittance),
    "nothing passes",
    "The share of light that passes through and is scattered on the other side, the same in all directions: leaves, paper, cloth. \
     Both sides are alike, and with `reflectance` it is 1 at most at every wavelength; the rest is absorbed.",
)
.tables(COLOURS);
const ROUGHNESS: Key =
    Key::default("roughness", Number, "0.0", "GGX's α; 0 is smooth. By a texture it is 0.001 at least.")
        .range("[0, 1]")
        .tables(NUMBERS);

const A_DIFFUSE: &str = r#"
[materials.paint.diffuse]
reflectance = { samples = [[380, 0.05], [500, 0.1], [600, 0.7], [780, 0.8]] }
two_sided = false
temperature = 300.0
opacity = 0.5
"#;
const A_WARM_SKIN: &str = r#"
[materials.paint.diffuse]
emissivity = 0.98
temperature = "33.5 C"
"#;
const A_SCREEN: &str = r#"
[materials.paint.diffuse]              # a screen that is looked at from behind
reflectance = 0.0
transmittance = 0.8
"#;
const A_LEAF: &str = r#"
[materials.paint.diffuse]
reflectance = { samples = [[400, 0.05], [550, 0.12], [680, 0.05], [750, 0.48], [900, 0.48]], outside = "hold" }
transmittance = { samples = [[400, 0.01], [550, 0.1], [680, 0.02], [750, 0.45], [900, 0.47]], outside = "hold" }
"#;
const A_CONDUCTOR: &str = r#"
[materials.paint.conductor]
nk = "gold.csv"
roughness = [0.1, 0.3]
energy_compensation = true
two_sided = true
opacity = { texture = "mask.png" }
"#;
const A_DIELECTRIC: &str = r#"
[materials.paint.dielectric]
eta = { file = "n-bk7.yml", column = "n" }
dispersion = true
roughness = 0.0
opacity = 1.0
"#;
const A_PLASTIC: &str = r#"
[materials.paint.plastic]
reflectance = { rgb = [0.1, 0.2, 0.6] }
eta = 1.5
roughness = 0.05                       # or { texture = "mask.png" }
opacity = 0.9
"#;
const A_BLEND: &str = r#"
[materials.paint.blend]
a = "primer"
b = "rust"
weight = { texture = "mask.png" }
temperature = 310.0
opacity = 0.8

[materials.primer.diffuse]
reflectance = 0.6

[materials.rust.diffuse]
reflectance = { rgb = [0.3, 0.1, 0.05] }
"#;
const A_BLACK: &str = r#"
[materials.paint.black]
two_sided = true
temperature = 2856.0
opacity = 0.5
"#;

pub static DIFFUSE: Section = Section {
    path: "materials.NAME.diffuse",
    heading: "`[materials.NAME.diffuse]`",
    summary: "Lambert's law",
    about: "",
    keys: &[REFLECTANCE.unless("`emissivity`"), EMISSIVITY, TRANSMITTANCE, TWO_SIDED, TEMPERATURE, OPACITY],
    later: &[],
    at: "materials.paint.diffuse",
    examples: &[A_DIFFUSE, A_WARM_SKIN, A_SCREEN, A_LEAF],
    notes: "With a `temperature` it emits 1 - reflectance - transmittance of what a black body does.",
};

pub static CONDUCTOR: Section = Section {
    path: "materials.NAME.conductor",
    heading: "`[materials.NAME.conductor]`",
    summary: "a metal",
    about: "",
    keys: &[
        Key::required(
            "nk",
            File,
            "The complex index of refraction n + i k: CSV with the columns nm, n, k, or YAML of refractiveindex.info. \
             k > 0 absorbs.",
        )
        .unless("`eta` and `k`"),
        Key::required("eta", Spectrum(Quantity::Index), "Its real part n. With `k`, in the place of `nk`.")
            .unless("`nk`"),
        Key::required("k", Spectrum(Quantity::Extinction), "Its imaginary part. With `eta`, in the place of `nk`.")
            .unless("`nk`"),
        Key::default(
            "roughness",
            Number,
            "0.0",
            "GGX's α, 0 a mirror; or two, along u and across it ([Textures](#textures) says where u is), both at \
             least 0.001 or both below. By a texture it is the same in all directions, and 0.001 at least.",
        )
        .or("`[alpha_x, alpha_y]`")
        .range("[0, 1]")
        .tables(NUMBERS),
        Key::default(
            "energy_compensation",
            Boolean,
            "true",
            "Whether light that meets several facets is counted, so that a rough metal is as bright as its flakes; \
             `false` is single scattering, as most renderers have it.",
        ),
        TWO_SIDED,
        TEMPERATURE,
        OPACITY,
    ],
    later: &[],
    at: "materials.paint.conductor",
    examples: &[
        A_CONDUCTOR,
        r#"
[materials.paint.conductor]
eta = 0.2
k = { samples = [[380, 1.9], [780, 4.7]] }
temperature = 350.0
"#,
    ],
    notes: "",
};

pub static DIELECTRIC: Section = Section {
    path: "materials.NAME.dielectric",
    heading: "`[materials.NAME.dielectric]`",
    summary: "the boundary of glass, water, a crystal",
    about: "A boundary that reflects and refracts, and absorbs nothing. Behind its front is the inside, so shapes \
            should be closed, with their faces turned outward.",
    keys: &[
        Key::required("eta", Spectrum(Quantity::Index), "The index of refraction inside over that outside."),
        Key::default(
            "dispersion",
            Boolean,
            "true",
            "Whether directions differ by wavelength where `eta` does: a path that is refracted then goes on for one \
             channel, chosen at random, or for all where the boundary is rough enough ([METHOD.md](METHOD.md#techniques)). `false` bends all by the mean index; how much is reflected still differs by \
             channel.",
        ),
        ROUGHNESS,
        Key::optional(
            "temperature",
            Refused,
            "it has none",
            "Always an error, since what absorbs nothing emits nothing. Glass that absorbs has an `interior` on its \
             object, whose medium may have a temperature.",
        ),
        OPACITY,
    ],
    later: &[],
    at: "materials.paint.dielectric",
    examples: &[A_DIELECTRIC],
    notes: "",
};

pub static PLASTIC: Section = Section {
    path: "materials.NAME.plastic",
    heading: "`[materials.NAME.plastic]`",
    summary: "a diffuse base under a clear coat",
    about: "Light goes to and fro between base and coat, so that what comes out is darker and more saturated than the base.",
    keys: &[
        REFLECTANCE,
        Key::required("eta", Spectrum(Quantity::CoatIndex), "The coat's index of refraction over that outside."),
        ROUGHNESS,
        TWO_SIDED,
        TEMPERATURE,
        OPACITY,
    ],
    later: &[],
    at: "materials.paint.plastic",
    examples: &[
        A_PLASTIC,
        r#"
[materials.paint.plastic]              # a warm varnish, its back black
reflectance = 0.3
eta = { file = "n-bk7.yml", column = "n" }
two_sided = false
temperature = 310.0
"#,
    ],
    notes: "",
};

pub static BLEND: Section = Section {
    path: "materials.NAME.blend",
    heading: "`[materials.NAME.blend]`",
    summary: "two materials, each with a share",
    about: "(1 - weight) of what `a` scatters and weight of what `b` does. Blends may blend blends, up to 32 \
            materials, never themselves.",
    keys: &[
        Key::required("a", Name("material"), "The first material."),
        Key::required("b", Name("material"), "The second one."),
        Key::required("weight", Number, "The share of `b`.").range("[0, 1]").tables(NUMBERS),
        Key::optional("temperature", Number, "that of its parts", "Of those parts that have none of their own.")
            .unit("K")
            .range("(0, 1e9]")
            .tables(NUMBERS),
        OPACITY,
    ],
    later: &[],
    at: "materials.paint.blend",
    examples: &[A_BLEND],
    notes: "",
};

pub static BLACK: Section = Section {
    path: "materials.NAME.black",
    heading: "`[materials.NAME.black]`",
    summary: "absorbs everything",
    about: "It needs no keys.",
    keys: &[TWO_SIDED, TEMPERATURE, OPACITY],
    later: &[],
    at: "materials.paint.black",
    examples: &[A_BLACK],
    notes: "",
};

const FILTER: Key = Key::default(
    "filter",
    Choice(&["bilinear", "nearest"]),
    "\"bilinear\"",
    "What is between the centres of texels: their mean by distance, or each texel all over itself.",
);
const SCALE: Key = Key::default(
    "scale",
    Number,
    "1.0",
    "Multiplies the texture coordinates of the surface, before `offset` is added: 2 shows the picture twice along each side; \
     negative values mirror.",
)
.or("`[u, v]`")
.range("[-1e4, 1e4]");
const OFFSET: Key = Key::default(
    "offset",
    List("`[u, v]`"),
    "[0, 0]",
    "Added to the scaled texture coordinates, each from -1e4 to 1e4.",
);

pub static TEXTURE: Section = Section {
    path: "texture",
    heading: "`{ texture = …, endmembers = … }`",
    summary: "a reflectance that differs from place to place",
    about: "In the place of the reflectance of `diffuse` or `plastic`. With `endmembers` each channel of the picture \
            is the share of one spectrum; without, the picture is a colour.",
    keys: &[
        Key::required(
            "texture",
            File,
            "A picture, PNG or OpenEXR. Of colours: R, G and B, or grey, in [0, 1]; a PNG is sRGB, an OpenEXR linear; \
             each texel's spectrum is that of `rgb`. Of shares: each in [0, 1], taken as they are, together 1 at \
             most.",
        ),
        Key::optional(
            "endmembers",
            List("list of spectra"),
            "the picture is a colour",
            "Reflectances, 1 to 32: one for each channel of the picture, in its order. That is R, G, B in a PNG, by \
             name in an OpenEXR: they sort by the alphabet. Shares that sum to less than 1 leave the rest black.",
        )
        .tables(&[&super::SPECTRUM]),
        FILTER,
        SCALE,
        OFFSET,
    ],
    later: &[],
    at: "materials.ground.diffuse.reflectance",
    examples: &[
        r#"
[materials.ground.diffuse.reflectance]
texture = "abundance.png"              # its red is asphalt, green lawn, blue soil
endmembers = [0.1, "lawn", { file = "spectra/soil.csv" }]

[spectra.lawn]
samples = [[400, 0.04], [550, 0.12], [680, 0.05], [750, 0.5], [900, 0.55]]
outside = "hold"
"#,
        r#"
[materials.ground.diffuse]
reflectance = { texture = "albedo.png", filter = "nearest", scale = [4, 2], offset = [0.5, 0] }
"#,
    ],
    notes: "",
};

pub static TEXTURE_OF_NUMBERS: Section = Section {
    path: "texture-of-numbers",
    heading: "`{ texture = … }`",
    summary: "a weight, temperature, opacity or roughness that differs from place to place",
    about: "In the place of the `weight` of a blend or of a surface's `temperature`, `opacity` or `roughness`.",
    keys: &[
        Key::required(
            "texture",
            File,
            "A grey picture, or one whose R, G and B are the same. Of weights, opacities and roughnesses (GGX's α): PNG or OpenEXR, in \
             [0, 1], taken as they are. Of temperatures: OpenEXR, in K, in [0, 1e9]; what is at 0 emits nothing.",
        ),
        FILTER,
        SCALE,
        OFFSET,
    ],
    later: &[],
    at: "materials.roof.diffuse.temperature",
    examples: &[r#"
[materials.roof.diffuse]
reflectance = 0.2

[materials.roof.diffuse.temperature]
texture = "kelvin.exr"
filter = "nearest"
scale = 0.5
offset = [0.25, 0.25]
"#],
    notes: "",
};

pub static TEXTURE_OF_LIGHT: Section = Section {
    path: "texture-of-light",
    heading: "`{ texture = …, strength = … }`",
    summary: "a radiance that differs from place to place",
    about: "In the place of the `emission` of an object. With `endmembers` each channel of the picture says how much there is of one \
            lamp; without, the picture is a colour: a screen, a sign, a window.",
    keys: &[
        Key::required(
            "texture",
            File,
            "A picture, PNG or OpenEXR. Of colours: R, G and B, or grey, at least 0; a PNG is sRGB, an OpenEXR linear; each texel's \
             radiance is that of `rgb` as emission, D65 with Y = 1 where it is [1, 1, 1]. With `endmembers`: at least 0, taken as \
             they are.",
        ),
        Key::optional(
            "endmembers",
            List("list of spectra"),
            "the picture is a colour",
            "Radiances, 1 to 32: one for each channel of the picture, as for textures of reflectances.",
        )
        .tables(&[&super::SPECTRUM]),
        Key::default("strength", Number, "1.0", "Multiplies the radiance.").range("[0, 1e30]"),
        FILTER,
        SCALE,
        OFFSET,
    ],
    later: &[],
    at: "objects.0.emission",
    examples: &[
        r#"
[[objects]]
quad = { corner = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 1, 0] }
material = "lamp"

[objects.emission]
texture = "albedo.png"
strength = 2.5
filter = "nearest"
scale = 1.5
offset = [0.25, 0.5]
"#,
        r#"
[[objects]]
quad = { corner = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 1, 0] }
material = "lamp"

[objects.emission]
texture = "abundance.png"
endmembers = [0.1, { blackbody = 3000 }, { blackbody = 5000, scale = 1e-3 }]
"#,
    ],
    notes: "Light is aimed at evenly over such a surface: a few bright texels on a dark one are noisy.",
};
