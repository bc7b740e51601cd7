//! `--bands`: some channels of a cube, by number or by wavelength.

use crate::spectral::Channels;

/// Bands as they are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Bands {
    text: String,
    items: Vec<Item>,
}

#[derive(Debug, Clone, PartialEq)]
enum Item {
    One(usize),
    /// Half-open.
    Range(usize, usize),
    /// The channel at this wavelength, nm.
    At(f64),
    /// Channels with their centres between these, nm.
    Between(f64, f64),
}

impl Bands {
    pub fn parse(text: &str) -> Result<Bands, String> {
        let items = text.split(',').map(|item| parse_item(item.trim())).collect::<Option<Vec<Item>>>();
        items.map(|items| Bands { text: text.to_owned(), items }).ok_or_else(|| {
            "bands are numbers from 0 and ranges, or wavelengths with nm or um, such as 3, 0..10, 550nm or 8um..14um, with \
             commas between"
                .to_owned()
        })
    }

    /// The channels, in the order asked for. The message says what is not there.
    pub fn resolve(&self, channels: &Channels) -> Result<Vec<usize>, String> {
        let count = channels.len();
        let mut bands = Vec::new();
        for item in &self.items {
            match *item {
                Item::One(k) if k < count => bands.push(k),
                Item::Range(from, to) if from < to && to <= count => bands.extend(from..to),
                Item::One(_) | Item::Range(..) => {
                    return Err(format!("--bands {}: the bands of this cube are 0..{count}", self.text));
                }
                Item::At(nm) => {
                    let inside = (0..count).filter(|&k| channels.bounds[k][0] <= nm && nm <= channels.bounds[k][1]);
                    let distance = |k: usize| (channels.centre(k) - nm).abs();
                    let nearest = inside.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
                    bands.push(nearest.ok_or_else(|| format!("--bands {}: no band holds {nm} nm", self.text))?);
                }
                Item::Between(from, to) => {
                    let before = bands.len();
                    bands.extend((0..count).filter(|&k| (from..=to).contains(&channels.centre(k))));
                    if bands.len() == before {
                        return Err(format!("--bands {}: no band has its centre in {from}-{to} nm", self.text));
                    }
                }
            }
        }
        Ok(bands)
    }
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
        Bands::parse(text).and_then(|bands| bands.resolve(&Channels::equal(400.0, 800.0, 8)))
    }

    #[test]
    fn numbers_ranges_and_wavelengths() {
        assert_eq!(resolve("3"), Ok(vec![3]));
        assert_eq!(resolve("7, 0..3"), Ok(vec![7, 0, 1, 2]));
        assert_eq!(resolve("430nm,0.76um"), Ok(vec![0, 7]));
        assert_eq!(resolve("475nm..575 nm"), Ok(vec![1, 2, 3]));
        assert_eq!(resolve("0.5um..0.6µm"), Ok(vec![2, 3]));
    }

    #[test]
    fn mistakes_say_what_there_is() {
        for (text, words) in [
            ("8", "0..8"),
            ("3..3", "0..8"),
            ("0..9", "0..8"),
            ("900nm", "no band holds 900 nm"),
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
