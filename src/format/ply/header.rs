//! The head of a PLY file, which is text in every file.

/// What a PLY file says it holds.
#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Bytes and lines before the first element.
    pub body: usize,
    pub lines: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    pub line: usize,
}

#[derive(Debug)]
pub struct Property {
    pub name: String,
    /// Of the value, or of each in a list.
    pub scalar: Scalar,
    /// Of a list: the type of the number of its elements.
    pub length: Option<Scalar>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// By either of the names that writers use.
    fn named(name: &str) -> Option<Scalar> {
        Some(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// Bytes in binary files.
    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }
}

/// The header, or the line of a mistake and what it is.
pub fn parse(bytes: &[u8]) -> Result<Header, (usize, String)> {
    let mut header = Header { encoding: Encoding::Text, elements: Vec::new(), body: 0, lines: 0 };
    let mut encoding = None;
    loop {
        let rest = &bytes[header.body..];
        let line = header.lines + 1;
        let Some(end) = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else {
            let message = match line {
                1 => "is no PLY file: its first line is not `ply`",
                _ => "the header has no `end_header`",
            };
            return Err((line, message.to_owned()));
        };
        // Where lines end in CR alone, the first byte of a binary body may be LF.
        let is_pair = rest[end..].starts_with(b"\r\n");
        header.body += end + if is_pair { 2 } else { 1 };
        header.lines = line;
        let text = String::from_utf8_lossy(&rest[..end]);
        let words: Vec<&str> = text.split_whitespace().collect();
        let wrong = |message: String| Err((line, message));
        match words[..] {
            ["ply"] if line == 1 => {}
            _ if line == 1 => return wrong("is no PLY file: its first line is not `ply`".to_owned()),
            [] | ["comment" | "obj_info", ..] => {}
            ["format", kind, "1.0"] => {
                encoding = Some(match kind {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return wrong(format!("the format `{kind}` is unknown")),
                });
            }
            ["format", ..] => return wrong("the format needs a name and the version 1.0".to_owned()),
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return wrong(format!("`{}` is no number of elements", count.escape_debug()));
                };
                if header.elements.iter().any(|element| element.name == name) {
                    return wrong(format!("there is a second element \"{}\"", name.escape_debug()));
                }
                header.elements.push(Element { name: name.to_owned(), count, properties: Vec::new(), line });
            }
            ["property", ref of @ .., name] => {
                let Some(element) = header.elements.last_mut() else {
                    return wrong("a property stands before the first element".to_owned());
                };
                let (scalar, length) = match of {
                    [scalar] => (Scalar::named(scalar), Some(None)),
                    ["list", length, scalar] => (Scalar::named(scalar), Scalar::named(length).map(Some)),
                    _ => return wrong("a property is `TYPE NAME` or `list TYPE TYPE NAME`".to_owned()),
                };
                let Some((scalar, length)) = scalar.zip(length) else {
                    return wrong(format!("the type of `{}` is unknown", name.escape_debug()));
                };
                if matches!(length, Some(Scalar::F32 | Scalar::F64)) {
                    return wrong("the length of a list is a whole number".to_owned());
                }
                element.properties.push(Property { name: name.to_owned(), scalar, length });
            }
            ["end_header"] => break,
            [first, ..] => {
                let shown: String = first.chars().take(20).collect();
                return wrong(format!("`{}` is no statement of a PLY header", shown.escape_debug()));
            }
        }
    }
    header.encoding = encoding.ok_or((header.lines, "the header has no format".to_owned()))?;
    Ok(header)
}
