//! A report as one page of HTML without outside parts.

use std::fmt::Write;

/// What a page is made of, in order.
pub struct Page {
    title: String,
    body: String,
}

/// Text as HTML shows it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// What every page begins with.
pub const BEGINS: &str =
    "<!doctype html>\n<html lang=en><head><meta charset=utf-8><meta name=viewport content=\"width=device-width\">";

const STYLE: &str = "\
:root{color-scheme:light dark}\
body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}\
figure{margin:1.5rem 0}svg{max-width:100%;height:auto;background:#fff}\
figcaption,.note{color:#777;font-size:.9em}\
table{border-collapse:collapse;margin:1rem 0;font-variant-numeric:tabular-nums}\
th,td{padding:.2rem .7rem;border-bottom:1px solid #8886;text-align:right}\
th:first-child,td:first-child{text-align:left}\
.fail{color:#c22;font-weight:600}.pass{color:#283}";

impl Page {
    pub fn new(title: &str, introduction: &str) -> Page {
        let body = format!("<h1>{}</h1>\n<p>{}</p>\n", escaped(title), escaped(introduction));
        Page { title: escaped(title), body }
    }

    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    pub fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// An SVG with its caption.
    pub fn figure(&mut self, svg: &str, caption: &str) {
        let _ = writeln!(self.body, "<figure>{svg}<figcaption>{}</figcaption></figure>", escaped(caption));
    }

    /// Cells that are `pass` or `fail` are coloured.
    pub fn table(&mut self, head: &[String], rows: &[Vec<String>]) {
        let cells = |tag: &str, cells: &[String]| {
            let cell = |text: &String| {
                let class =
                    if matches!(text.as_str(), "pass" | "fail") { format!(" class={text}") } else { String::new() };
                format!("<{tag}{class}>{}</{tag}>", escaped(text))
            };
            format!("<tr>{}</tr>", cells.iter().map(cell).collect::<String>())
        };
        let rows: String = rows.iter().map(|row| cells("td", row) + "\n").collect();
        let _ = writeln!(self.body, "<table><thead>{}</thead>\n<tbody>\n{rows}</tbody></table>", cells("th", head));
    }

    pub fn finish(self) -> String {
        format!(
            "{BEGINS}<title>{}</title>\n<style>{STYLE}</style></head>\n<body>\n{}</body></html>\n",
            self.title, self.body
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_stands_alone_and_shows_text_as_text() {
        let mut page = Page::new("A & B", "x < y");
        page.table(&["what".into(), "verdict".into()], &[vec!["<i>".into(), "fail".into()]]);
        page.figure("<svg></svg>", "caption");
        let html = page.finish();
        for part in ["<h1>A &amp; B</h1>", "x &lt; y", "<td>&lt;i&gt;</td>", "<td class=fail>fail</td>", "<svg></svg>"]
        {
            assert!(html.contains(part), "{part} is missing");
        }
        assert!(!html.contains("http") && !html.contains("src="));
    }
}
