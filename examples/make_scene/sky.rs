//! A clear sky from LOWTRAN's transmittances: sunlight scattered once by molecules and haze in closed form, scattered
//! more often as the rest of the two-stream balance, and the air's own heat; and the sun below it.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use glam::{DVec3, dvec3};

/// The sun stands where LOWTRAN's slant path leads.
pub const SUN_ZENITH: f64 = 60.0;
/// Of the rural aerosol of 23 km visibility: a very clear day.
const HAZE: f64 = 0.25;
const GROUND_ALBEDO: f64 = 0.15;
/// K.
const GROUND_TEMPERATURE: f64 = 293.0;

/// A table of numbers under a header; comments are left out.
pub struct Table(Vec<Vec<f64>>);

impl Table {
    pub fn read(path: &Path) -> io::Result<Table> {
        let text = fs::read_to_string(path)?;
        let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        let wrong = || io::Error::other(format!("{}: not a table of numbers", path.display()));
        let rows = lines.map(|line| line.split(',').map(|cell| cell.parse().map_err(|_| wrong())).collect());
        rows.collect::<io::Result<_>>().map(Table)
    }

    /// The value of a column at `nm`, linear in between, held beyond the ends.
    pub fn at(&self, nm: f64, column: usize) -> f64 {
        let i = self.0.partition_point(|row| row[0] <= nm).clamp(1, self.0.len() - 1);
        let (a, b) = (&self.0[i - 1], &self.0[i]);
        let t = ((nm - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
        a[column] + t * (b[column] - a[column])
    }
}

pub struct Sky {
    solar: Table,
    vertical: Table,
    slant: Table,
    /// Towards the sun.
    pub sun: DVec3,
}

impl Sky {
    /// Reads the tables in `spectra`; the sun stands at `azimuth` degrees from +x towards +z.
    pub fn read(spectra: &Path, azimuth: f64) -> io::Result<Sky> {
        let (sin, cos) = SUN_ZENITH.to_radians().sin_cos();
        let (s, c) = azimuth.to_radians().sin_cos();
        Ok(Sky {
            solar: Table::read(&spectra.join("solar_am0.csv"))?,
            vertical: Table::read(&spectra.join("lowtran7_vertical.csv"))?,
            slant: Table::read(&spectra.join("lowtran7_slant_60deg.csv"))?,
            sun: dvec3(sin * c, cos, sin * s),
        })
    }

    /// Irradiance above the atmosphere, W m-2 nm-1. The table ends at 4 um: from there on a black body's shape.
    fn solar(&self, nm: f64) -> f64 {
        const END: f64 = 4000.0;
        self.solar.at(nm.min(END), 1) * if nm > END { planck(nm, 5778.0) / planck(END, 5778.0) } else { 1.0 }
    }

    /// Optical depths of the whole air with its haze, at air mass 1 and 2.
    fn depths(&self, nm: f64) -> [f64; 2] {
        [&self.vertical, &self.slant].map(|table| {
            let depth = |column| -table.at(nm, column).max(1e-6).ln();
            let (clear, rural) = (depth(1), depth(3));
            clear + HAZE * (rural - clear).max(0.0)
        })
    }

    /// The direct irradiance of the sun on a plane that faces it, W m-2 nm-1.
    fn direct(&self, nm: f64) -> f64 {
        self.solar(nm) * (-self.depths(nm)[1]).exp()
    }

    /// What does not depend on direction, at one wavelength.
    fn at(&self, nm: f64) -> Air {
        let um = nm / 1000.0;
        let haze = HAZE * (self.vertical.at(nm, 1).max(1e-6) / self.vertical.at(nm, 3).max(1e-6)).ln().max(0.0);
        // Hansen and Travis, Space Sci. Rev. 16, 527 (1974), at sea level.
        let molecules = 0.008_569 * um.powi(-4) * (1.0 + 0.0113 * um.powi(-2) + 0.000_13 * um.powi(-4));
        let depths = self.depths(nm);
        let mu = SUN_ZENITH.to_radians().cos();
        let thermal = [&self.vertical, &self.slant].map(|table| {
            let (clear, rural) = (table.at(nm, 2), table.at(nm, 4));
            (clear + HAZE * (rural - clear)) * 1e-3
        });
        let gas = (depths[0] - molecules - haze).max(0.0);
        let mut air = Air {
            molecules,
            haze,
            // Gases lie mostly below what scatters: the sun's light has passed them once.
            sunlight: self.solar(nm) * (-gas / mu).exp(),
            depths,
            thermal,
            diffuse: 0.0,
            ground: 0.0,
        };
        // Flux through a layer that scatters without loss, by the Eddington approximation (Shettle and Weinman, J. Atmos.
        // Sci. 27, 1048, 1970), over a bright ground; the part that single scattering has not got is spread evenly.
        let depth = molecules + haze;
        let asymmetry = HAZE_ASYMMETRY * haze / depth;
        let beam = (-depth / mu).exp();
        let total = ((2.0 / 3.0 + mu) + (2.0 / 3.0 - mu) * beam) / (4.0 / 3.0 + (1.0 - asymmetry) * depth);
        let back = (1.0 - asymmetry) * depth / (4.0 / 3.0 + (1.0 - asymmetry) * depth);
        let flux = air.sunlight * mu * (total - beam).max(0.0) / (1.0 - GROUND_ALBEDO * back);
        air.diffuse = (flux - air.scattered_flux(self.sun)).max(0.0) / PI;
        let arriving = self.direct(nm) * mu + air.scattered_flux(self.sun) + PI * air.diffuse;
        air.ground = GROUND_ALBEDO * arriving / PI + 0.96 * planck(nm, GROUND_TEMPERATURE);
        air
    }

    /// Writes the lat-long map as ENVI: [y][band][x] of f32, a band for each of `nm`; row 0 is the zenith, and the
    /// middle column looks along -z, the columns turning towards +x.
    pub fn write_map(&self, path: &Path, size: [usize; 2], nm: &[f64]) -> io::Result<()> {
        let [width, height] = size;
        let air: Vec<Air> = nm.iter().map(|nm| self.at(*nm)).collect();
        let mut bytes = Vec::with_capacity(width * height * nm.len() * 4);
        for y in 0..height {
            let (sin, cos) = (PI * (y as f64 + 0.5) / height as f64).sin_cos();
            let views: Vec<DVec3> = (0..width)
                .map(|x| {
                    let (s, c) = (TAU * ((x as f64 + 0.5) / width as f64 - 0.5)).sin_cos();
                    dvec3(sin * s, cos, -sin * c)
                })
                .collect();
            for air in &air {
                views.iter().for_each(|view| bytes.extend((air.radiance(*view, self.sun) as f32).to_le_bytes()));
            }
        }
        fs::write(path.with_extension("img"), bytes)?;
        let list: Vec<String> = nm.iter().map(|nm| format!("{nm}")).collect();
        let header = format!(
            "ENVI\ndescription = {{ spectral radiance of a clear sky }}\nsamples = {width}\nlines = {height}\nbands = {}\n\
             header offset = 0\nfile type = ENVI Standard\ndata type = 4\ninterleave = bil\nbyte order = 0\n\
             data units = W m^-2 sr^-1 nm^-1\nwavelength units = Nanometers\nwavelength = {{ {} }}\n",
            nm.len(),
            list.join(", ")
        );
        fs::write(path.with_extension("hdr"), header)?;
        println!("{}: {width} x {height} x {} bands", path.display(), nm.len());
        Ok(())
    }

    /// Writes the sun's direct irradiance at the ground, `nm,irradiance`.
    pub fn write_sun(&self, path: &Path) -> io::Result<()> {
        let mut text = String::from(
            "# COMPUTED: ASTM G173 AM0 x LOWTRAN7 transmittance at 60 degrees; W m-2 nm-1\nwavelength_nm,irradiance\n",
        );
        text.push_str(&format!("380,{:.5e}\n", self.direct(380.0)));
        for row in &self.slant.0 {
            writeln!(text, "{},{:.5e}", row[0], self.direct(row[0])).expect("memory");
        }
        fs::write(path, text)
    }
}

/// Henyey and Greenstein's parameter for haze.
const HAZE_ASYMMETRY: f64 = 0.72;

struct Air {
    molecules: f64,
    haze: f64,
    sunlight: f64,
    depths: [f64; 2],
    /// W m-2 sr-1 nm-1, at air mass 1 and 2.
    thermal: [f64; 2],
    diffuse: f64,
    ground: f64,
}

impl Air {
    fn radiance(&self, view: DVec3, sun: DVec3) -> f64 {
        // The last texels above the horizon look through 38 air masses; below it lies the ground, veiled at the horizon.
        let degrees = view.y.clamp(-1.0, 1.0).acos().to_degrees();
        let mass = air_mass(degrees.min(90.0));
        let cosine = dvec3(view.x, view.y.max(0.0), view.z).normalize_or(DVec3::X).dot(sun);
        let sky = self.single(mass, cosine) + self.diffuse + self.heat(mass);
        if degrees <= 90.0 {
            return sky;
        }
        let veil = (-(degrees - 90.0) / 2.0).exp();
        veil * sky + (1.0 - veil) * self.ground
    }

    /// Sunlight scattered once in a plane layer, seen from below it.
    fn single(&self, mass: f64, cosine: f64) -> f64 {
        let depth = self.molecules + self.haze;
        let rayleigh = 0.75 * (1.0 + cosine * cosine);
        let g = HAZE_ASYMMETRY;
        let henyey = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5);
        let phase = (self.molecules * rayleigh + self.haze * henyey) / depth;
        let sun = 1.0 / SUN_ZENITH.to_radians().cos();
        // (exp(-depth sun) - exp(-depth mass)) mass / (mass - sun), also where both masses are equal.
        let difference = depth * (mass - sun);
        let path = if difference.abs() < 1e-6 { 1.0 } else { -(-difference).exp_m1() / difference };
        self.sunlight * phase / (4.0 * PI) * mass * depth * (-depth * sun).exp() * path
    }

    /// The flux of [`Air::single`] on the ground.
    fn scattered_flux(&self, sun: DVec3) -> f64 {
        let (rows, columns) = (24, 24);
        let mut flux = 0.0;
        for i in 0..rows {
            // Even in the square of the cosine: each direction carries the same share.
            let mu = ((f64::from(i) + 0.5) / f64::from(rows)).sqrt();
            let sin = (1.0 - mu * mu).sqrt();
            for j in 0..columns {
                let (s, c) = (TAU * (f64::from(j) + 0.5) / f64::from(columns)).sin_cos();
                let view = dvec3(sin * c, mu, sin * s);
                flux += self.single(air_mass(mu.acos().to_degrees()), view.dot(sun));
            }
        }
        flux * PI / f64::from(rows * columns)
    }

    /// The air's own emission: of the mean temperature that LOWTRAN's two paths show, by the emissivity of the path. The
    /// optical depth grows as a power of the air mass that meets both.
    fn heat(&self, mass: f64) -> f64 {
        let [one, two] = self.depths;
        let power = (two / one).log2();
        let depth = one * mass.powf(power);
        let source = [self.thermal[0] / -(-one).exp_m1(), self.thermal[1] / -(-two).exp_m1()];
        // Longer paths see lower, warmer air; from air mass 6 on no further.
        let t = mass.min(6.0).log2().min(2.0);
        (source[0] + t * (source[1] - source[0])).max(0.0) * -(-depth).exp_m1()
    }
}

/// Kasten and Young, Appl. Opt. 28, 4735 (1989); degrees from the zenith.
fn air_mass(zenith: f64) -> f64 {
    1.0 / (zenith.to_radians().cos() + 0.505_72 * (96.079_95 - zenith).powf(-1.6364))
}

/// W m-2 sr-1 nm-1.
fn planck(nm: f64, kelvin: f64) -> f64 {
    const C1L: f64 = 1.191_042_972e-16; // 2hc^2, W m2 sr-1
    const C2: f64 = 1.438_776_877e-2; // m K
    let m = nm * 1e-9;
    C1L / m.powi(5) / (C2 / (m * kelvin)).exp_m1() * 1e-9
}
