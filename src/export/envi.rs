//! ENVI: raw numbers beside a header.

use std::borrow::Cow;
use std::fs;
use std::io::{Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::{PIECE_BYTES, Progress, check_space, default_bands, long_name};
use crate::cube::{Integers, Quantity, Reader, Rect, Strides, View};
use crate::files::output::{Product, Replacement};
use crate::format::envi::{self, DataType, Image, Interleave};
use crate::{Error, Result};

/// The numbers that [`write`] writes, and the header without which they are none.
const DATA: Product = Product {
    name: "ENVI data with a header beside it",
    extensions: &["img", "bil", "bip", "bsq"],
    is_stream: false,
    is_folder: false,
    check: is_data,
};
const HEADER: Product =
    Product { name: "an ENVI header", extensions: &["hdr"], is_stream: false, is_folder: false, check: is_header };

/// Whether the header beside it describes just these bytes.
fn is_data(path: &Path) -> std::result::Result<(), String> {
    let header = header_of(path);
    let bytes = fs::read(&header).map_err(|error| format!("has no header {} ({error})", header.display()))?;
    let described = envi::parse(&bytes, &header).map_err(|_| format!("has a {} that is none", header.display()))?;
    let length = fs::metadata(path).map_err(|error| format!("cannot be read ({error})"))?.len();
    match described.data_bytes() {
        Some(bytes) if bytes == length => Ok(()),
        _ => Err(format!("has {length} bytes, and {} describes other data", header.display())),
    }
}

fn is_header(path: &Path) -> std::result::Result<(), String> {
    let bytes = fs::read(path).map_err(|error| format!("cannot be read ({error})"))?;
    envi::parse(&bytes, path).map(drop).map_err(|problem| problem.message)
}

/// The header that belongs to a data file.
fn header_of(data: &Path) -> PathBuf {
    data.with_extension("hdr")
}

/// A header that GDAL, and so QGIS, reads instead of the one that is written.
pub fn other_header(path: &Path) -> Option<PathBuf> {
    let mut name = data_of(path).into_os_string();
    name.push(".hdr");
    let other = PathBuf::from(name);
    other.exists().then_some(other)
}

/// A header of ENVI and an OpenEXR file that share a name, of which an export to `path` has just written one: where GDAL
/// cannot read OpenEXR it takes its bytes for the header's data.
pub fn header_beside_exr(path: &Path) -> Option<[PathBuf; 2]> {
    let pair = ["hdr", "exr"].map(|extension| path.with_extension(extension));
    (pair[1].exists() && is_header(&pair[0]).is_ok()).then_some(pair)
}

/// The data file of an export to `path`, which may name its header.
fn data_of(path: &Path) -> PathBuf {
    let is_header = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hdr"));
    if is_header { path.with_extension("img") } else { path.to_owned() }
}

/// Refuses early what cannot be written to: both files are new, or both are there and belong together.
pub fn check_target(path: &Path) -> Result<()> {
    let data = data_of(path);
    let header = header_of(&data);
    if data.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zarr")) {
        return Err(Error::Usage(format!("{}: GDAL opens no ENVI file of this name; use .img", data.display())));
    }
    DATA.check_target(&data)?;
    HEADER.check_target(&header)?;
    if header.exists() && !data.exists() {
        let what = format!("is the header of other data: there is no {}; so it is not replaced", data.display());
        return Err(Error::Usage(format!("{} {what}; choose another name", header.display())));
    }
    Ok(())
}

/// What stands where nothing is rendered: no radiance and no temperature is negative.
pub const MISSING: f32 = -9999.0;

/// Writes the data file and, last, its header beside it. `path` may name either.
pub fn write(view: &View, path: &Path, interleave: Interleave, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    check_target(path)?;
    check_space(&data_of(path), view.bytes())?;
    let [width, height] = view.size().map(|side| side as usize);
    let channels = view.channels();
    let each = |value: &dyn Fn(usize) -> f64| (0..channels.len()).map(value).collect();
    let image = Image {
        description: long_name(view),
        size: [width, height, channels.len()],
        interleave,
        data_type: match view.integers() {
            None => DataType::F32,
            Some(Integers { is_short: true, .. }) => DataType::U16,
            Some(_) => DataType::U32,
        },
        units: match view.quantity() {
            Quantity::Radiance | Quantity::Xyz(_) => "W m^-2 sr^-1 nm^-1",
            Quantity::Integrated => "W m^-2 sr^-1",
            Quantity::Temperature => "K",
            Quantity::Reflectance => "reflectance",
            Quantity::Counts => "DN",
        },
        ignore: view.integers().map_or(MISSING.into(), |integers| integers.missing.into()),
        origin: view.origin(),
        default_bands: Some(default_bands(view)),
        wavelength_nm: each(&|k| channels.centre(k)),
        fwhm_nm: each(&|k| channels.fwhm(k)),
        names: channels.names.clone(),
        map: view.georeference(),
    };
    write_files(path, &image, &mut |file| {
        let mut pieces =
            Pieces { view, reader: view.reader(), file, values: Vec::new(), progress, missing: MISSING, begin: 0 };
        match interleave {
            Interleave::Bil => pieces.by_line(),
            Interleave::Bip => pieces.by_pixel(),
            Interleave::Bsq => pieces.by_band(),
        }
    })
}

/// Writes the numbers of an image as `fill` does, and its header.
pub fn write_files(
    path: &Path,
    image: &Image,
    fill: &mut dyn FnMut(&mut Replacement) -> Result<()>,
) -> Result<Vec<PathBuf>> {
    let data = data_of(path);
    let header = header_of(&data);
    check_target(path)?;
    let mut file = Replacement::create(&data, DATA)?;
    fill(&mut file)?;
    // Both are whole before either takes its place. The data goes first: it is known by the header of the old one.
    let mut about = Replacement::create(&header, HEADER)?;
    let written = about.file().write_all(image.header().as_bytes());
    written.map_err(|error| about.failed(&error))?;
    check_target(path)?;
    file.finish()?;
    about.finish()?;
    Ok(vec![data, header])
}

/// Numbers on their way into a file.
pub(super) struct Pieces<'a, 'p> {
    pub view: &'a View<'a>,
    pub reader: Reader<'a>,
    pub file: &'a mut Replacement,
    pub values: Vec<f32>,
    pub progress: &'a mut Progress<'p>,
    /// Instead of NaN, of values that are no whole numbers.
    pub missing: f32,
    /// Where in the file the first one goes, of [`Pieces::by_band`].
    pub begin: u64,
}

/// `count` in pieces of at most `most`, which is taken as at least 1.
fn pieces(count: usize, most: usize) -> impl Iterator<Item = Range<usize>> {
    let most = most.max(1);
    (0..count.div_ceil(most)).map(move |i| i * most..(i * most + most).min(count))
}

impl Pieces<'_, '_> {
    /// [line][band][sample].
    fn by_line(&mut self) -> Result<()> {
        let (width, bands) = (self.view.size()[0] as usize, self.view.channels().len());
        for rows in self.rows(width * bands * 4) {
            for part in pieces(bands, PIECE_BYTES / (4 * width)) {
                let strides = Strides { row: width * part.len(), pixel: 1, band: width };
                // More than one line at a time only where all bands fit.
                self.read(rows, part, strides)?;
                self.write()?;
            }
            self.tell(rows)?;
        }
        Ok(())
    }

    /// [line][sample][band].
    fn by_pixel(&mut self) -> Result<()> {
        let (width, bands) = (self.view.size()[0] as usize, self.view.channels().len());
        for rows in self.rows(width * bands * 4) {
            for part in pieces(width, PIECE_BYTES / (4 * bands)) {
                let strides = Strides { row: part.len() * bands, pixel: bands, band: 1 };
                let (x0, x1) = (rows.x0 + part.start as u32, rows.x0 + part.end as u32);
                self.read(Rect { x0, x1, ..rows }, 0..bands, strides)?;
                self.write()?;
            }
            self.tell(rows)?;
        }
        Ok(())
    }

    /// [band][line][sample]: a row of tiles at a time, so that the cube is read once.
    pub fn by_band(&mut self) -> Result<()> {
        let [width, height] = self.view.size().map(|side| side as usize);
        let (rect, tile) = (self.view.rect(), self.view.cube().grid().tile[1]);
        let mut y0 = rect.y0;
        while y0 < rect.y1 {
            let rows = Rect { y0, y1: ((y0 / tile + 1) * tile).min(rect.y1), ..rect };
            let plane = width * rows.height() as usize;
            for part in pieces(self.view.channels().len(), PIECE_BYTES / (4 * plane)) {
                self.read(rows, part.clone(), Strides { row: width, pixel: 1, band: plane })?;
                let values = std::mem::take(&mut self.values);
                for (band, values) in part.zip(values.chunks_exact(plane)) {
                    let bytes = match self.view.integers() {
                        None => Cow::Borrowed(bytemuck::cast_slice(values)),
                        Some(integers) => Cow::Owned(integers.encode(values)),
                    };
                    let each = (bytes.len() / values.len()) as u64;
                    let at = self.begin + each * (band * height + (y0 - rect.y0) as usize) as u64 * width as u64;
                    let file = self.file.file();
                    let written = file.seek(SeekFrom::Start(at)).and_then(|_| file.write_all(&bytes));
                    written.map_err(|error| self.file.failed(&error))?;
                }
                self.values = values;
            }
            self.tell(rows)?;
            y0 = rows.y1;
        }
        Ok(())
    }

    /// The lines of the view in groups that lie in one row of tiles and take about a piece.
    fn rows(&self, line_bytes: usize) -> impl Iterator<Item = Rect> + use<> {
        let (rect, tile) = (self.view.rect(), self.view.cube().grid().tile[1]);
        let most = (PIECE_BYTES / line_bytes).max(1) as u32;
        let mut y0 = rect.y0;
        std::iter::from_fn(move || {
            let y1 = y0.saturating_add(most).min((y0 / tile + 1) * tile).min(rect.y1);
            let rows = (y0 < rect.y1).then_some(Rect { y0, y1, ..rect });
            y0 = y1;
            rows
        })
    }

    fn read(&mut self, rect: Rect, bands: Range<usize>, strides: Strides) -> Result<()> {
        self.values.resize(rect.pixels() as usize * bands.len(), 0.0);
        self.reader.read(rect, bands, strides, &mut self.values)?;
        if self.view.integers().is_none() {
            self.values.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = self.missing);
        }
        Ok(())
    }

    fn write(&mut self) -> Result<()> {
        let written = match self.view.integers() {
            None => self.file.file().write_all(bytemuck::cast_slice(&self.values)),
            Some(integers) => self.file.file().write_all(&integers.encode(&self.values)),
        };
        written.map_err(|error| self.file.failed(&error))
    }

    fn tell(&mut self, rows: Rect) -> Result<()> {
        let width = u64::from(rows.width());
        (self.progress)(u64::from(rows.y1 - self.view.rect().y0) * width, self.view.rect().pixels())
    }
}
