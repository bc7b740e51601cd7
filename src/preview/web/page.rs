//! The page, one document put together from its parts. Nothing of it comes from anywhere else.

use std::sync::OnceLock;

const DOCUMENT: &str = include_str!("page/page.html");
const PARTS: [(&str, &str); 7] = [
    ("{{uPlot.css}}", include_str!("page/vendor/uPlot.min.css")),
    ("{{page.css}}", include_str!("page/page.css")),
    ("{{uPlot.js}}", include_str!("page/vendor/uPlot.iife.min.js")),
    ("{{picture.js}}", include_str!("page/picture.js")),
    ("{{spectra.js}}", include_str!("page/spectra.js")),
    ("{{progress.js}}", include_str!("page/progress.js")),
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
        page
    });
    page.replace("{{nonce}}", nonce)
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
        assert!(page.len() < 150 << 10, "{} bytes", page.len());
    }
}
