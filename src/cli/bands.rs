//! `--bands`: some channels of a cube, by name, number or wavelength.

use crate::spectral::Channels;

/// Bands as they are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Bands {
    text: String,
    items: Vec<(String, Option<Item>)>,
}

#[derive(Debug, Clone, PartialEq)]
enum Item {
    One(usize),
    /// Half-open.
    Range(usize, usize),
    /// The channel with its centre nearest to this wavelength, nm.
    At(f64),
    /// Channels with their centres between these, nm.
    Between(f64, f64),
}

/// The channels that [`Bands`] mean, in the order asked for.
#[derive(Debug, PartialEq)]
pub struct Chosen {
    pub channels: Vec<usize>,
    /// What users might have meant otherwise.
    pub notes: Vec<String>,
}

impl Bands {
    /// Names may be anything, but not nothing.
    pub fn parse(text: &str) -> Result<Bands, String> {
        let items: Vec<_> = text.split(',').map(|item| (item.trim().to_owned(), parse_item(item.trim()))).collect();
        match items.iter().any(|(item, _)| item.is_empty()) {
            true => Err(format!("{FORMS}, with commas between")),
            false => Ok(Bands { text: text.to_owned(), items }),
        }
    }

    /// The channels: names come before numbers and wavelengths. The message says what is not there.
    pub fn resolve(&self, channels: &Channels) -> Result<Chosen, String> {
        let count = channels.len();
        let (mut bands, mut notes) = (Vec::new(), Vec::new());
        for (text, item) in &self.items {
            if let Some(k) = channels.names.iter().position(|name| name == text) {
                if item.is_some() {
                    notes.push(format!("--bands: {text} is the name of band {k}, counted from 0"));
                }
                bands.push(k);
                continue;
            }
            match *item {
                Some(Item::One(k)) if k < count => {
                    notes.extend(wavelengths_too(channels, text, [k, k]));
                    bands.push(k);
                }
                Some(Item::Range(from, to)) if from < to && to <= count => {
                    notes.extend(wavelengths_too(channels, text, [from, to]));
                    bands.extend(from..to);
                }
                Some(Item::One(_) | Item::Range(..)) => {
                    return Err(format!("--bands {}: the bands of this cube are 0..{count}", self.text));
                }
                Some(Item::At(nm)) => {
                    let (k, note) = nearest(channels, nm).map_err(|what| format!("--bands {}: {what}", self.text))?;
                    notes.extend(note.map(|note| format!("--bands: {note}")));
                    bands.push(k);
                }
                Some(Item::Between(from, to)) => {
                    let before = bands.len();
                    bands.extend((0..count).filter(|&k| (from..=to).contains(&channels.centre(k))));
                    if bands.len() == before {
                        return Err(format!("--bands {}: no band has its centre in {from}-{to} nm", self.text));
                    }
                }
                None => {
                    const SHOWN: usize = 12;
                    let names = channels.names.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
                    let more = if count > SHOWN { " …" } else { "" };
                    return Err(format!(
                        "--bands {}: no band is named {text}, they are {names}{more}; {FORMS}",
                        self.text
                    ));
                }
            }
        }
        Ok(Chosen { channels: bands, notes })
    }
}

const FORMS: &str = "bands are names, numbers from 0 and ranges, or wavelengths with nm or um, such as B4, 3, 0..10, 550nm or 8um..14um";

/// What to say of the numbers `ends`, written as `text`, where bands have them as wavelengths too.
fn wavelengths_too(channels: &Channels, text: &str, ends: [usize; 2]) -> Option<String> {
    let holds = |end: usize| channels.bounds.iter().any(|[from, to]| (*from..=*to).contains(&(end as f64)));
    let first = channels.centre(ends[0]);
    // Of cubes whose numbers are their wavelengths there is nothing to say.
    let is_both = ends.into_iter().all(holds) && (first - ends[0] as f64).abs() > 1.0;
    is_both.then(|| {
        let meant = text.replace("..", "nm..");
        format!("--bands: {text} counts bands, from 0, and begins at {first:.2} nm; wavelengths are written {meant}nm")
    })
}

/// The channel with its centre nearest to `nm`, and what to say where it does not hold that wavelength.
fn nearest(channels: &Channels, nm: f64) -> Result<(usize, Option<String>), String> {
    let [from, to] = channels.hull().unwrap_or([f64::NAN; 2]);
    if !(from..=to).contains(&nm) {
        return Err(format!("{nm} nm lies outside of all bands, {from} to {to} nm"));
    }
    let distance = |k: usize| (channels.centre(k) - nm).abs();
    let nearest = (0..channels.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    let k = nearest.ok_or("there are no bands")?;
    let [low, high] = channels.bounds[k];
    let note = (!(low..=high).contains(&nm)).then(|| {
        format!("{nm} nm lies between bands, the nearest is {} at {:.2} nm", channels.names[k], channels.centre(k))
    });
    Ok((k, note))
}

fn parse_item(text: &str) -> Option<Item> {
    let wavelength = |text: &str| -> Option<f64> {
        let text = text.trim();
        let (number, factor) = match text.strip_suffix("nm") {
            Some(number) => (number, 1.0),
            None => (text.strip_suffix("um").or_else(|| text.strip_suffix("µm"))?, 1e3),
        };
        number.trim_end().parse().ok().map(|v: f64| v * factor).filter(|nm| nm.is_finite() && *nm > 0.0)
    };
    match text.split_once("..") {
        Some((from, to)) => match (from.trim().parse(), to.trim().parse()) {
            (Ok(from), Ok(to)) => Some(Item::Range(from, to)),
            _ => {
                let (from, to) = (wavelength(from)?, wavelength(to)?);
                (from <= to).then_some(Item::Between(from, to))
            }
        },
        None => text.parse().ok().map(Item::One).or_else(|| wavelength(text).map(Item::At)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolve(text: &str) -> Result<Vec<usize>, String> {
        let chosen = Bands::parse(text).and_then(|bands| bands.resolve(&Channels::equal(400.0, 800.0, 8)))?;
        assert!(chosen.notes.is_empty(), "{chosen:?}");
        Ok(chosen.channels)
    }

    /// A sensor's bands, with names that are numbers, and a gap.
    #[test]
    fn names_come_before_numbers() {
        let bounds = vec![[450.0, 500.0], [520.0, 580.0], [640.0, 690.0], [780.0, 900.0], [440.0, 900.0]];
        let mut channels = Channels::from_bounds(bounds, None);
        channels.names = ["4", "3", "2", "8A", "pan"].map(String::from).to_vec();
        let chosen = |text: &str| Bands::parse(text).expect("bands").resolve(&channels);
        let Chosen { channels: bands, notes } = chosen("2,3, 4 ,pan,8A").expect("names");
        assert_eq!((bands, notes.len()), (vec![2, 1, 0, 4, 3], 3));
        assert!(
            notes[0].contains("2 is the name of band 2") && notes[2].contains("4 is the name of band 0"),
            "{notes:?}"
        );
        assert_eq!(chosen("1").expect("no name"), Chosen { channels: vec![1], notes: Vec::new() });
        // 670 nm is that of the panchromatic band, from which the red one is 5 nm away.
        assert_eq!(chosen("670nm, 660nm").expect("centres").channels, [4, 2]);
        let between = chosen("605nm").expect("between");
        assert_eq!(between.channels, [1]);
        assert!(between.notes[0].contains("between bands, the nearest is 3 at 550.00 nm"), "{between:?}");
        let wrong = chosen("8B").expect_err("no name");
        assert!(wrong.contains("no band is named 8B") && wrong.contains("8A"), "{wrong}");
    }

    #[test]
    fn numbers_ranges_and_wavelengths() {
        assert_eq!(resolve("3"), Ok(vec![3]));
        assert_eq!(resolve("7, 0..3"), Ok(vec![7, 0, 1, 2]));
        assert_eq!(resolve("430nm,0.76um"), Ok(vec![0, 7]));
        assert_eq!(resolve("475nm..575 nm"), Ok(vec![1, 2, 3]));
        assert_eq!(resolve("0.5um..0.6µm"), Ok(vec![2, 3]));
        // 400 to 700 nm in a thousand bands: 425 is the number of one, and the wavelength of another.
        let channels = Channels::equal(400.0, 700.0, 1000);
        let told = |text: &str| Bands::parse(text).and_then(|bands| bands.resolve(&channels)).expect("bands").notes;
        assert_eq!(
            told("425"),
            ["--bands: 425 counts bands, from 0, and begins at 527.65 nm; wavelengths are written 425nm"]
        );
        assert!(told("400..500")[0].ends_with("wavelengths are written 400nm..500nm"));
        assert_eq!(told("7,0..10,300..500,425nm"), Vec::<String>::new());
    }

    #[test]
    fn mistakes_say_what_there_is() {
        for (text, words) in [
            ("8", "0..8"),
            ("3..3", "0..8"),
            ("0..9", "0..8"),
            ("900nm", "900 nm lies outside of all bands, 400 to 800 nm"),
            ("900nm..950nm", "900-950 nm"),
            ("", "550nm"),
            ("x", "550nm"),
            ("-1", "550nm"),
            ("600nm..500nm", "550nm"),
            ("1,,2", "550nm"),
            ("nannm", "550nm"),
            ("3nm..4", "550nm"),
        ] {
            let message = resolve(text).unwrap_err();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
