//! Names in messages: lists of them, and which one was probably meant.

use std::fmt::Display;

/// `a, b, c`.
pub fn list<T: Display>(names: impl IntoIterator<Item = T>) -> String {
    names.into_iter().map(|n| n.to_string()).collect::<Vec<_>>().join(", ")
}

/// `"a", "b", "c"`.
pub fn quoted<T: Display>(names: impl IntoIterator<Item = T>) -> String {
    list(names.into_iter().map(|n| format!("\"{n}\"")))
}

/// The nearest of `names`, where one is near enough to be meant.
pub fn nearest<'n>(written: &str, names: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let best = names.into_iter().min_by_key(|name| edit_distance(written, name))?;
    let allowed = 1 + written.chars().count().min(best.chars().count()) / 3;
    (edit_distance(written, best) <= allowed).then_some(best)
}

pub fn suggestion(name: &str) -> String {
    format!("did you mean `{name}`?")
}

/// A hint at the nearest of `names`, where one is near enough to be meant.
pub fn did_you_mean<'n>(written: &str, names: impl IntoIterator<Item = &'n str>) -> Option<String> {
    nearest(written, names).map(suggestion)
}

/// Levenshtein distance in characters, of the first 64 of each.
pub fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().take(64).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().take(64).enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        for (a, b, expected) in [("", "abc", 3), ("width", "widht", 2), ("kitten", "sitting", 3), ("x", "x", 0)] {
            assert_eq!(edit_distance(a, b), expected, "{a} {b}");
        }
    }

    #[test]
    fn suggestions_are_near_or_absent() {
        let names = ["width", "height", "filter", "crop"];
        assert_eq!(did_you_mean("widht", names).as_deref(), Some("did you mean `width`?"));
        assert_eq!(did_you_mean("temperature", names), None);
    }
}
