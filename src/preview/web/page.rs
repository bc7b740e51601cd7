//! The page, one document put together from its parts. Nothing of it comes from anywhere else.

use std::sync::OnceLock;

use serde_json::json;

use crate::spectral::tone::{MAP_LEVELS, map_level, srgb8};

const DOCUMENT: &str = include_str!("page/page.html");
const PARTS: [(&str, &str); 8] = [
    ("{{uPlot.css}}", include_str!("page/vendor/uPlot.min.css")),
    ("{{page.css}}", include_str!("page/page.css")),
    ("{{uPlot.js}}", include_str!("page/vendor/uPlot.iife.min.js")),
    ("{{picture.js}}", include_str!("page/picture.js")),
    ("{{spectra.js}}", include_str!("page/spectra.js")),
    ("{{progress.js}}", include_str!("page/progress.js")),
    ("{{relight.js}}", include_str!("page/relight.js")),
    ("{{page.js}}", include_str!("page/page.js")),
];

/// The document, whose scripts run only with `nonce`.
pub fn page(nonce: &str) -> String {
    static PAGE: OnceLock<String> = OnceLock::new();
    let page = PAGE.get_or_init(|| {
        let mut page = DOCUMENT.to_owned();
        for (place, part) in PARTS {
            page = page.replace(place, part);
        }
        page.replace("{{tone}}", &tone())
    });
    page.replace("{{nonce}}", nonce)
}

/// What the page needs to show numbers as colours, so that exposure follows the hand without asking for pictures: 8-bit sRGB
/// over the square root of linear values from 0 to 1, of which it almost is a straight line, and the colour map.
fn tone() -> String {
    const STEPS: usize = 8191;
    let srgb: Vec<u8> = (0..=STEPS).map(|i| srgb8((i as f64 / STEPS as f64).powi(2))).collect();
    // A sorted table: how many steps have each value.
    let steps = srgb.chunk_by(|a, b| a == b).map(<[u8]>::len).collect::<Vec<_>>();
    json!({ "srgb_steps": steps, "map": (0..MAP_LEVELS).flat_map(map_level).collect::<Vec<u8>>() }).to_string()
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_page_is_whole_and_asks_nobody_else() {
        let page = super::page("abc");
        assert!(!page.contains("{{") && page.contains("<script nonce=\"abc\">"));
        for part in super::PARTS {
            assert!(page.contains(part.1), "{}", part.0);
            // A part that ended its own element would end the page.
            assert!(!part.1.contains("</script") && !part.1.contains("</style"), "{}", part.0);
        }
        for loads in [" src=", "@import", "url(", "import("] {
            assert!(!page.contains(loads), "{loads}");
        }
        let tone: serde_json::Value = serde_json::from_str(&super::tone()).expect("JSON");
        let counts: Vec<u64> =
            tone["srgb_steps"].as_array().expect("a list").iter().filter_map(|n| n.as_u64()).collect();
        assert_eq!((counts.len(), counts.iter().sum()), (256, 8192), "every one of the 256 values occurs");
        assert!(page.len() < 150 << 10, "{} bytes", page.len());
    }
}
