//! Tables as CSV (RFC 4180): cells are quoted where their text asks for it.

/// A table in memory.
pub struct Table(csv::Writer<Vec<u8>>);

impl Table {
    pub fn new<T: AsRef<str>>(head: impl IntoIterator<Item = T>) -> Table {
        let mut table = Table(csv::Writer::from_writer(Vec::new()));
        table.row(head);
        table
    }

    /// Adds a line of as many cells as the head has.
    pub fn row<T: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = T>) {
        let written = cells.into_iter().try_for_each(|cell| self.0.write_field(cell.as_ref()));
        let ended = written.and_then(|()| self.0.write_record(None::<&[u8]>));
        ended.expect("as many cells as in the head, and memory takes all of them");
    }

    pub fn finish(self) -> String {
        let bytes = self.0.into_inner().expect("memory takes all of it");
        String::from_utf8(bytes).expect("of text that was UTF-8")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_where_they_must_be() {
        let mut table = Table::new(["name", "n"]);
        for name in ["box", "a=1, b=2", "the \"red\" one", "two\nlines", ""] {
            table.row([name, "1e-30"]);
        }
        let expected =
            "name,n\nbox,1e-30\n\"a=1, b=2\",1e-30\n\"the \"\"red\"\" one\",1e-30\n\"two\nlines\",1e-30\n,1e-30\n";
        assert_eq!(table.finish(), expected);
    }
}
