//! Media that scatter, as devices get them: the techniques by which paths decide where they go in them (docs/METHOD.md, Techniques), what each
//! takes of a way, and the phase functions.

use crate::device::part::{Part, Place, Records};
use crate::device::parts::media::{self, Filled, List, Media};
use crate::device::parts::surfaces::Needed;
use crate::device::parts::techniques::{Asking, Techniques};
use crate::device::text::module;
use crate::device::words::{
    NONE, PHASE_HENYEY_GREENSTEIN, PHASE_RAYLEIGH, PHASE_TABLE, VOLUME_BY_EXTINCTION, VOLUME_WORDS, VOLUMES_HEAD,
};
use crate::scene::{self, Component, Field, Medium, Phase, PhaseTable, Scene, SpectrumId};
use crate::spectral::{Curve, Outside};

pub const SCATTERING: Part = Part {
    name: "media that scatter",
    used: |scene| scene.scattering.is_some(),
    effect: |scene| {
        scene.scattering.as_ref().map_or_else(String::new, |scattering| scattering.words(&scene.techniques))
    },
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/scattering/directions.wgsl")),
        (Place::Stage, module!("stages/flight.wgsl")),
        (Place::Stage, module!("stages/matter.wgsl")),
    ],
    defines: |scene, _, defines| {
        defines.set("SCATTERS", true).constant("TECHNIQUES", scene.techniques.count() as u32);
        defines.set("SCALED", true);
    },
    // Of a way that is gone on from somewhere within: its throughput put aside and taken back, and what lies before that place. At
    // a collision each kind of matter takes two, for the light and for the path.
    records: |scene| {
        let way = scene.media.as_ref().map_or(0, Media::way_records);
        let scatterers = scene.scattering.as_ref().map_or(0, |scattering| scattering.most_scatterers);
        Records { way: way + 2, vertex: 4 * scatterers, path: 0 }
    },
    example: Some(|exhibit| exhibit.add_cloud()),
    ..Part::NOTHING
};

pub const FORCED: Part = Part {
    name: "forced collisions",
    used: |scene| scene.scattering.as_ref().is_some_and(|scattering| scattering.forced),
    effect: |_| "the way of a camera ray is summed up once more before its flight".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("FORCED", true),
    ..Part::NOTHING
};

pub const TABLES: Part = Part {
    name: "tables of phase functions",
    used: |scene| scene.scattering.as_ref().is_some_and(|scattering| scattering.has_tables),
    effect: |_| "directions are chosen by the table itself".into(),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/scattering/phase_tables.wgsl")),
        (Place::Generate, module!("parts/scattering/table_directions.wgsl")),
        (Place::Evaluate, media::VOLUME),
        (Place::Evaluate, module!("parts/scattering/phase_tables.wgsl")),
    ],
    defines: |_, _, defines| _ = defines.set("PHASE_TABLES", true),
    example: Some(|exhibit| exhibit.add_droplets()),
    ..Part::NOTHING
};

const WORDS: usize = VOLUME_WORDS as usize;

/// Optical depths below this are as this: nothing is scattered noticeably.
const LEAST_DEPTH: f64 = 0.1;
/// Ratios of optical depths below this need one technique.
const SMALL_RATIO: f64 = 1.3;
/// Of a technique's own phase function in that by which it chooses; the rest is the mean over channels.
const OWN_SHARE: f64 = 0.9;
/// Degrees between rows of tables on the device, at most: between them sines are linear to 2.4e-6.
const ROW_DEGREES: f64 = 0.25;

/// What media that scatter need on a device, beside the words that it adds to their volumes.
pub struct Scattering {
    pub has_tables: bool,
    /// Whether camera rays that meet nothing are always scattered.
    pub forced: bool,
    pub most_scatterers: u32,
    /// Names of media in which paths go as far as their extinction says.
    by_extinction: Vec<String>,
}

/// What media that scatter are in every channel, before it is known by how many techniques paths decide.
pub struct Coefficients(Vec<OfMedium>);

impl Coefficients {
    /// `None` where nothing scatters; else media ask for techniques.
    pub fn of(scene: &Scene, media: &Media, asking: &mut Asking) -> Option<Coefficients> {
        if !media.places.iter().any(|place| scene.media[place.medium].scatters()) {
            return None;
        }
        let all: Vec<OfMedium> = scene.media.iter().map(|medium| OfMedium::new(scene, medium)).collect();
        ask(scene, &media.places, &all, asking);
        Some(Coefficients(all))
    }
}

impl Scattering {
    /// Adds to the words and spectra of `media`.
    pub fn new(scene: &Scene, media: &mut Media, coefficients: &Coefficients, techniques: &Techniques) -> Scattering {
        let mut scattering = Scattering {
            has_tables: false,
            forced: scene.integrator.forced_collision,
            most_scatterers: 0,
            by_extinction: Vec::new(),
        };
        let mut tables = Tables::default();
        for (i, place) in media.places.clone().into_iter().enumerate() {
            let (medium, of) = (&scene.media[place.medium], &coefficients.0[place.medium]);
            let first = VOLUMES_HEAD as usize + WORDS * i;
            let mut list = List::default();
            list.push_numbers(of.walked(medium, techniques));
            let scatterers = medium.components.iter().filter(|component| component.scattering.is_some()).count() as u32;
            list.words.push(scatterers);
            scattering.most_scatterers = scattering.most_scatterers.max(scatterers);
            for (c, component) in medium.components.iter().enumerate() {
                if let Some(how) = &component.scattering {
                    list.push_density(place.densities[c]);
                    of.scatterer(scene, media, techniques, &mut tables, (c, how), &mut list);
                }
            }
            media.volumes[first + 22] = media.append(list);
            if of.by_extinction {
                media.volumes[first] |= VOLUME_BY_EXTINCTION;
                if !scattering.by_extinction.contains(&medium.name) {
                    scattering.by_extinction.push(medium.name.clone());
                }
            }
        }
        scattering.has_tables = !tables.0.is_empty();
        let words = tables.words(scene, techniques, media.volumes.len() as u32);
        media.volumes[4] = media.append(words.into());
        scattering
    }

    fn words(&self, techniques: &Techniques) -> String {
        let mut words = match techniques.count() {
            1 => "one technique".to_owned(),
            count => format!("{count} techniques"),
        };
        if !self.by_extinction.is_empty() {
            words += &format!(", by extinction in {}", self.by_extinction.join(", "));
        }
        words + "; directions at each collision"
    }
}

/// Of a medium: coefficients in each channel at density 1, and densities as they are on the whole.
struct OfMedium {
    /// Of each kind of matter.
    components: Vec<ComponentCoefficients>,
    /// Whether more is absorbed than scattered in all channels, so that paths would go deep for nothing.
    by_extinction: bool,
}

struct ComponentCoefficients {
    /// m⁻¹ in each channel, of each column of each absorber, at strength and density 1.
    columns: Vec<Vec<f64>>,
    /// m⁻¹ in each channel; empty where nothing is scattered.
    scattering: Vec<f64>,
    /// g in each channel, of Henyey and Greenstein's phase function.
    asymmetry: Vec<f64>,
    density: f64,
    /// Its absorption in each channel at the medium's mean temperature, at density 1.
    absorption: Vec<f64>,
}

fn means(scene: &Scene, spectrum: SpectrumId) -> Vec<f64> {
    let curve = &scene.spectra[spectrum].curve;
    scene.channels.bounds.iter().map(|b| curve.mean(b[0], b[1])).collect()
}

/// On the whole.
fn mean(field: &Field) -> f64 {
    match field {
        Field::Constant(value) => *value,
        Field::Grid(grid) => grid.values.iter().map(|v| f64::from(*v)).sum::<f64>() / grid.values.len() as f64,
    }
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn least_of(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Of an amount on a way: what every technique makes of it for how far paths go; what it loses of it, and the channel that absorbs least.
type Term = (Vec<f64>, Vec<f64>, f64);

impl OfMedium {
    fn new(scene: &Scene, medium: &Medium) -> OfMedium {
        let kelvin = medium.temperature.as_ref().map(mean);
        let count = scene.channels.len();
        let component = |component: &Component| {
            let columns = component.absorbers.iter().flat_map(|absorber| &absorber.columns);
            let mut absorption = vec![0.0; count];
            let terms = component.absorbers.iter().flat_map(|absorber| media::absorption_of(absorber, kelvin, 1.0));
            for (spectrum, factor) in terms {
                absorption.iter_mut().zip(means(scene, spectrum)).for_each(|(sum, value)| *sum += factor * value);
            }
            let scattering = component.scattering.as_ref();
            let asymmetry = match scattering.map(|scattering| &scattering.phase) {
                Some(Phase::HenyeyGreenstein(g)) => means(scene, *g),
                _ => Vec::new(),
            };
            ComponentCoefficients {
                columns: columns.map(|column| means(scene, column.1)).collect(),
                scattering: scattering.map_or_else(Vec::new, |scattering| means(scene, scattering.coefficient)),
                asymmetry,
                density: mean(&component.density),
                absorption,
            }
        };
        let components: Vec<ComponentCoefficients> = medium.components.iter().map(component).collect();
        let total = |of: fn(&ComponentCoefficients, usize) -> f64, k: usize| -> f64 {
            components.iter().map(|component| component.density * of(component, k)).sum()
        };
        let by_extinction = medium.scatters()
            && (0..count).all(|k| total(ComponentCoefficients::scattered, k) < total(|c, k| c.absorption[k], k));
        OfMedium { components, by_extinction }
    }

    /// What decides how far paths go, of one kind of matter in channel `k`, at its mean density.
    fn deciding(&self, component: &ComponentCoefficients, k: usize) -> f64 {
        let absorbed = if self.by_extinction { component.absorption[k] } else { 0.0 };
        component.density * (component.scattered(k) + absorbed)
    }

    /// Words of a volume: for each amount on a way, what every technique makes of it for how far paths go; then what every technique, and the
    /// channel that absorbs least, loses of it.
    fn walked(&self, medium: &Medium, techniques: &Techniques) -> Vec<f64> {
        let terms = if medium.grid_size().is_some() {
            self.along_amounts(techniques)
        } else {
            vec![self.along_metres(techniques)]
        };
        terms
            .into_iter()
            .flat_map(|(flights, losses, least)| flights.into_iter().chain(losses).chain([least]))
            .collect()
    }

    /// Of each amount of a medium of voxels.
    fn along_amounts(&self, techniques: &Techniques) -> Vec<Term> {
        let none = || vec![0.0; techniques.count()];
        let mut terms = Vec::new();
        for component in &self.components {
            for column in &component.columns {
                let values = techniques.values(column);
                terms.push(match self.by_extinction {
                    true => (values, none(), 0.0),
                    false => (none(), values, least_of(column)),
                });
            }
            if !component.scattering.is_empty() {
                terms.push((covering(techniques, &component.scattering), none(), 0.0));
            }
        }
        terms
    }

    /// The one amount of a medium that is the same everywhere: metres.
    fn along_metres(&self, techniques: &Techniques) -> Term {
        let (mut flights, mut losses) = (vec![0.0; techniques.count()], vec![0.0; techniques.count()]);
        let mut least = 0.0;
        for component in &self.components {
            let add = |sum: &mut Vec<f64>, values: Vec<f64>| {
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += component.density * value);
            };
            let absorbed = if self.by_extinction { &mut flights } else { &mut losses };
            add(absorbed, techniques.values(&component.absorption));
            if !self.by_extinction {
                least += component.density * least_of(&component.absorption);
            }
            if !component.scattering.is_empty() {
                add(&mut flights, covering(techniques, &component.scattering));
            }
        }
        (flights, losses, least)
    }

    /// Adds the words of kind of matter `number`, behind those of its density.
    fn scatterer(
        &self,
        scene: &Scene,
        media: &mut Media,
        techniques: &Techniques,
        tables: &mut Tables,
        (number, scattering): (usize, &scene::Scattering),
        list: &mut List,
    ) {
        let named = |id: SpectrumId| (scene.spectra[id].name.clone(), scene.spectra[id].curve.clone());
        let (name, curve) = named(scattering.coefficient);
        list.push_spectrum(media, Needed::Pointwise(name, curve));
        match &scattering.phase {
            Phase::HenyeyGreenstein(g) => {
                list.words.push(PHASE_HENYEY_GREENSTEIN);
                let (name, curve) = named(*g);
                list.push_spectrum(media, Needed::Exact(name, curve));
            }
            Phase::Rayleigh { depolarisation } => {
                list.words.push(PHASE_RAYLEIGH);
                list.push_numbers([depolarisation / (2.0 - depolarisation)]);
            }
            Phase::Table(table) => list.words.extend([PHASE_TABLE, tables.number(table)]),
        }
        list.push_numbers([self.share(number)]);
        match &scattering.phase {
            Phase::Table(table) => {
                list.push_spectrum(media, Needed::Exact("columns of a phase function".into(), axis(table)));
            }
            _ => list.words.push(NONE),
        }
        let own = &self.components[number];
        let asymmetry =
            if own.asymmetry.is_empty() { vec![0.0; techniques.count()] } else { techniques.values(&own.asymmetry) };
        list.push_numbers(covering(techniques, &own.scattering).into_iter().chain(asymmetry));
    }

    /// What a kind of matter counts, per density, where all channels have a say: half of the mean over channels of its share of what is
    /// scattered, half of the largest, so that it is positive wherever any channel is scattered.
    fn share(&self, number: usize) -> f64 {
        let channels = 0..self.components[number].scattering.len();
        let shares: Vec<f64> = channels
            .map(|k| {
                let all: f64 = self.components.iter().map(|component| component.density * component.scattered(k)).sum();
                if all > 0.0 { self.components[number].scattered(k) / all } else { 0.0 }
            })
            .collect();
        0.5 * mean_of(&shares) + 0.5 * shares.iter().copied().fold(0.0, f64::max)
    }
}

impl ComponentCoefficients {
    fn scattered(&self, k: usize) -> f64 {
        self.scattering.get(k).copied().unwrap_or(0.0)
    }
}

/// Lets media that scatter ask for techniques: by the ratios of the optical depths of bodies from end to end.
fn ask(scene: &Scene, places: &[Filled], coefficients: &[OfMedium], asking: &mut Asking) {
    let channels = scene.channels.len();
    let mut ratio: f64 = 1.0;
    for place in places.iter().filter(|place| scene.media[place.medium].scatters() && !place.is_repeated) {
        let of = &coefficients[place.medium];
        let mut spread = |depth: &dyn Fn(usize) -> f64| {
            let depths: Vec<f64> = (0..channels).map(|k| (depth(k) * place.extent).max(LEAST_DEPTH)).collect();
            let least = depths.iter().copied().fold(f64::INFINITY, f64::min);
            ratio = ratio.max(depths.iter().copied().fold(0.0, f64::max) / least);
            depths
        };
        spread(&|k| of.components.iter().map(|component| of.deciding(component, k)).sum());
        for component in &of.components {
            let depths = spread(&|k| of.deciding(component, k));
            asking.tell_apart(depths.into_iter().map(f64::ln));
            if !component.asymmetry.is_empty() {
                asking.tell_apart(component.asymmetry.iter().map(|g| ((1.0 + g) / (1.0 - g)).ln()));
            }
        }
    }
    if ratio >= SMALL_RATIO {
        let wanted = 1 + ratio.log2().ceil() as usize;
        asking.ask(wanted, || format!("scattering, whose optical depths differ by a factor of {ratio:.1}"));
    }
}

/// The same of what scatters, so that some technique goes wherever any channel does.
fn covering(techniques: &Techniques, by_channel: &[f64]) -> Vec<f64> {
    let mut values = techniques.values(by_channel);
    if values.iter().all(|value| *value == 0.0) {
        values[0] = mean_of(by_channel);
    }
    values
}

/// The place of a wavelength among the columns of a table; the outermost hold.
fn axis(table: &PhaseTable) -> Curve {
    match table.nm.len() {
        1 => Curve::Constant(0.0),
        count => {
            let value = (0..count).map(|i| i as f64).collect();
            Curve::Linear { nm: table.nm.clone(), value, outside: Outside::Hold }
        }
    }
}

/// The tables of a scene, each once.
#[derive(Default)]
struct Tables(Vec<PhaseTable>);

impl Tables {
    fn number(&mut self, table: &PhaseTable) -> u32 {
        let known = self.0.iter().position(|known| known == table);
        known.unwrap_or_else(|| {
            self.0.push(table.clone());
            self.0.len() - 1
        }) as u32
    }

    /// The word of each, the first of all being `first`; then of each its numbers of rows and columns, the angles in degrees, the columns,
    /// and for each technique its phase function and the share of directions up to each row.
    fn words(&self, scene: &Scene, techniques: &Techniques, first: u32) -> Vec<u32> {
        let mut words = vec![0; self.0.len()];
        for (number, table) in self.0.iter().enumerate() {
            words[number] = first + words.len() as u32;
            let degrees = rows(&table.degrees);
            words.extend([degrees.len() as u32, table.nm.len() as u32]);
            let column = |nm: f64| -> Vec<f64> { degrees.iter().map(|&degrees| table.value(degrees, nm)).collect() };
            let columns = table.nm.iter().flat_map(|nm| column(*nm));
            let mut numbers: Vec<f64> = degrees.iter().copied().chain(columns).collect();
            let centres: Vec<f64> = (0..scene.channels.len()).map(|k| scene.channels.centre(k)).collect();
            let mut mean = vec![0.0; degrees.len()];
            for &nm in &centres {
                mean.iter_mut().zip(column(nm)).for_each(|(mean, value)| *mean += value / centres.len() as f64);
            }
            let own = |k: &usize| {
                column(centres[*k])
                    .iter()
                    .zip(&mean)
                    .map(|(own, mean)| OWN_SHARE * own + (1.0 - OWN_SHARE) * mean)
                    .collect()
            };
            let techniques = if techniques.channels.is_empty() {
                vec![mean.clone()]
            } else {
                techniques.channels.iter().map(own).collect()
            };
            for technique in techniques {
                let shares = shares(&degrees, &technique);
                numbers.extend(technique.into_iter().chain(shares));
            }
            words.extend(numbers.into_iter().map(|value| (value as f32).to_bits()));
        }
        words
    }
}

/// Angles with others between them where they are far apart: a function that is linear between some is so between more.
fn rows(degrees: &[f64]) -> Vec<f64> {
    let mut all = vec![degrees[0]];
    for pair in degrees.windows(2) {
        let parts = ((pair[1] - pair[0]) / ROW_DEGREES).ceil().max(1.0);
        all.extend((1..=parts as u32).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / parts));
    }
    all
}

/// The share of directions up to each angle, of a phase function and a sine that are linear between `degrees`.
fn shares(degrees: &[f64], values: &[f64]) -> Vec<f64> {
    let sine = |i: usize| degrees[i].to_radians().sin().max(0.0);
    let mut sums = vec![0.0];
    for i in 1..degrees.len() {
        let [p, q] = [values[i - 1], values[i]];
        let [s, t] = [sine(i - 1), sine(i)];
        let part = (degrees[i] - degrees[i - 1]) * (p * s + 0.5 * (p * t + q * s) + q * t) / 3.0;
        sums.push(sums[i - 1] + part);
    }
    let all = sums[sums.len() - 1];
    sums.iter_mut().for_each(|sum| *sum /= all);
    sums
}
