//! `docs/cube.md` against what renders write: every array, attribute, file, record of a journal and fact of a run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;
use spectile::cube::{Cube, Existing, Writer};
use spectile::slurm;
use tempfile::TempDir;
use xxhash_rust::xxh3::xxh3_128;

use super::{spectile, text};

const PAGE: &str = include_str!("../../docs/cube.md");

const SCENE: &str = r#"
[camera.perspective]
position = [0.0, 0.2, 3.0]
look_at = [0.0, 0.0, 0.0]
fov = 50.0

[film]
width = 30
height = 40
crop = [2, 3, 26, 23]

[channels]
equal = { from = 400.0, to = 700.0, count = 5 }

[materials.grey.diffuse]
reflectance = 0.5

[materials.black.black]

[[objects]]
quad = { corner = [-1, -1, -1], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }
material = "grey"

[[objects]]
quad = { corner = [-0.3, 1, -0.5], edge_u = [0.6, 0, 0], edge_v = [0, 0, 0.6] }
material = "black"
emission = { samples = [[400, 1.0], [700, 2.0]] }
"#;
/// Its channels.
const K: u64 = 5;

/// Pixels of a tile: neither the crop's 24 x 20 nor its halves.
const TILE: u64 = 16;

/// The cells of the rows under a heading of the page, without the table's own head.
fn rows(heading: &str) -> Vec<Vec<String>> {
    let (_, rest) = PAGE.split_once(&format!("\n## {heading}\n")).unwrap_or_else(|| panic!("no `## {heading}`"));
    super::rows(rest.split("\n## ").next().expect("a part")).into_iter().skip(2).collect()
}

fn code(cell: &str) -> &str {
    cell.trim_matches('`')
}

/// Cubes of each kind, by the words that the page uses.
struct Cubes {
    folder: TempDir,
    names: [&'static str; 5],
}

impl Cubes {
    fn render() -> Cubes {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("scene.toml"), SCENE).expect("written");
        let responses = "nm,blue,red\n420,0,\n460,1,\n500,0,\n580,,0\n620,,1\n680,,0\n";
        std::fs::write(folder.path().join("s.csv"), responses).expect("written");
        let run = |arguments: &str| {
            let arguments: Vec<&str> = arguments.split(' ').collect();
            let output = spectile(folder.path(), &arguments, true);
            assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        };
        run("render scene.toml -o plain.zarr --spp 128 --tile 16 --quiet");
        run("render scene.toml -o uncertainty.zarr --spp 128 --tile 16 --quiet --uncertainty");
        run("render scene.toml -o responses.zarr --spp 1 --tile 16 --quiet --set channels.responses=s.csv");
        run("render scene.toml -o false_colour.zarr --spp 1 --tile 16 --quiet --set channels.false_colour=[4,2,0]");
        run("sensor plain.zarr --responses s.csv -o sensor.zarr");
        Cubes { folder, names: ["plain", "uncertainty", "responses", "false_colour", "sensor"] }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(format!("{name}.zarr"))
    }

    fn group(&self, name: &str) -> Value {
        json(&self.path(name).join("zarr.json"))
    }

    fn arrays(&self, name: &str) -> BTreeMap<String, Value> {
        let group = self.group(name);
        let arrays = group["consolidated_metadata"]["metadata"].as_object().expect("arrays");
        arrays.iter().map(|(name, array)| (name.clone(), array.clone())).collect()
    }
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

/// `1, 2, 0`.
fn list(value: &Value) -> String {
    let items: Vec<String> = value.as_array().expect("a list").iter().map(plain).collect();
    items.join(", ")
}

fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

#[test]
fn the_page_is_what_renders_write() {
    let cubes = Cubes::render();
    arrays_are_those_of_the_page(&cubes);
    attributes_of_arrays_are_those_of_the_page(&cubes);
    attributes_of_the_group_are_those_of_the_page(&cubes);
    files_are_those_of_the_page(&cubes);
    journals_are_laid_out_as_the_page_says(&cubes);
    runs_have_the_facts_of_the_page(&cubes);
    choices_have_the_fields_of_the_page(&cubes);
}

/// The arrays of factored cubes are as the chapter on them says, and nothing else differs from other cubes; with a remainder a record of the
/// journal has eight checksums and three sums of each channel more.
#[test]
fn factored_cubes_are_as_the_page_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let shiny = SCENE.replace("[materials.grey.diffuse]", "[materials.grey.plastic]\neta = 1.5");
    for (name, more, scene) in
        [("factored", "", SCENE), ("uncertainty", " --uncertainty", SCENE), ("remainder", " --uncertainty", &shiny)]
    {
        std::fs::write(folder.path().join("scene.toml"), scene).expect("written");
        let render = format!("render scene.toml -o {name}.zarr --spp 64 --tile 16 --quiet --factored{more}");
        let output = spectile(folder.path(), &render.split(' ').collect::<Vec<_>>(), true);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let path = folder.path().join(format!("{name}.zarr"));
        let group = json(&path.join("zarr.json"));
        let arrays = group["consolidated_metadata"]["metadata"].as_object().expect("arrays");
        let of_others: BTreeSet<String> = rows("Arrays").iter().map(|row| code(&row[0]).to_owned()).collect();
        let instead = ["radiance".to_owned(), "standard_error".to_owned()];
        let mut documented = rows("Factored cubes");
        documented.retain(|row| name == "remainder" || !code(&row[0]).starts_with("remainder"));
        let expected = of_others.into_iter().filter(|array| !instead.contains(array));
        let expected: BTreeSet<String> =
            expected.chain(documented.iter().map(|row| code(&row[0]).to_owned())).collect();
        assert_eq!(arrays.keys().cloned().collect::<BTreeSet<_>>(), expected);
        let groups = if name == "factored" { 2 } else { 8 };
        assert_eq!(factored_words(&group, "remainder").is_some(), name == "remainder");
        if name == "remainder" {
            let record = std::fs::metadata(path.join(".spectile/journal/0")).expect("a journal").len();
            assert!(record.is_multiple_of(136 + 16 * K + 8 * 16 + 3 * 8 * K), "{record}");
        }
        let most = factored_words(&group, "most_factors").and_then(|most| most.as_u64()).expect("a number");
        let size = |word: &str| -> u64 {
            match word.trim() {
                "⌈H/h⌉" | "⌈W/w⌉" => 2,
                "1" => 1,
                "2 + G" => 2 + groups,
                "1 + F" => 1 + most.max(1),
                "72 w h" => 72 * TILE * TILE,
                "K" => K,
                "H" => 20,
                "W" => 24,
                "h" | "w" => TILE,
                word => panic!("`{word}` is no size"),
            }
        };
        for row in documented {
            let found = &arrays[code(&row[0])];
            let sizes = |cell: &str| cell.split(',').map(|word| size(word).to_string()).collect::<Vec<_>>().join(", ");
            let codecs: Vec<String> = (found["codecs"].as_array().expect("codecs").iter())
                .map(|codec| match &codec["configuration"] {
                    order if order["order"].is_array() => {
                        format!("{} [{}]", plain(&codec["name"]), list(&order["order"]))
                    }
                    of => format!("{} {}", plain(&codec["name"]), plain(&of["endian"])),
                })
                .collect();
            let written = [
                list(&found["dimension_names"]),
                list(&found["shape"]),
                plain(&found["data_type"]),
                list(&found["chunk_grid"]["configuration"]["chunk_shape"]),
                codecs.join(", ").replace(" null", ""),
                plain(&found["fill_value"]),
            ];
            let page = [row[1].clone(), sizes(&row[2]), row[3].clone(), sizes(&row[4]), row[5].clone(), row[6].clone()];
            assert_eq!(written, page, "{}", row[0]);
            let file = code(&row[7]).replace("ROW", "1").replace("COLUMN", "0");
            assert!(path.join(&file).exists(), "{file}");
        }
    }
}

/// A field of the attribute `factored` of a group.
fn factored_words(group: &Value, field: &str) -> Option<Value> {
    let text = group["attributes"]["factored"].as_str().expect("JSON as text");
    serde_json::from_str::<Value>(text).expect("JSON").get(field).cloned()
}

/// Layers are the arrays of the chapter on them beside all others, with those attributes and files; and a record has six checksums more.
#[test]
fn layers_are_as_the_page_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let sun = "\n[[lights]]\ndirectional = { direction = [0, -1, -1], irradiance = 1.0 }\n";
    std::fs::write(folder.path().join("scene.toml"), format!("{SCENE}{sun}")).expect("written");
    let documented = rows("Layers");
    let names: Vec<&str> = documented.iter().map(|row| code(&row[0])).collect();
    let line = format!("render scene.toml -o layers.zarr --spp 64 --tile 16 --quiet --layers {}", names.join(","));
    let output = spectile(folder.path(), &line.split(' ').collect::<Vec<_>>(), true);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let path = folder.path().join("layers.zarr");
    let group = json(&path.join("zarr.json"));
    let arrays = group["consolidated_metadata"]["metadata"].as_object().expect("arrays");
    let others = rows("Arrays");
    let others = others.iter().map(|row| code(&row[0])).filter(|array| *array != "standard_error");
    assert_eq!(
        arrays.keys().map(String::as_str).collect::<BTreeSet<_>>(),
        others.chain(names.iter().copied()).collect()
    );
    for row in &documented {
        let found = &arrays[code(&row[0])];
        let size = |word: &str| match word.trim() {
            "W" => "24".to_owned(),
            "H" => "20".to_owned(),
            "w" | "h" => TILE.to_string(),
            number => number.to_owned(),
        };
        let sizes = |cell: &str| cell.split(',').map(size).collect::<Vec<_>>().join(", ");
        let codec = &found["codecs"][0];
        let written = [
            list(&found["dimension_names"]),
            list(&found["shape"]),
            plain(&found["data_type"]),
            list(&found["chunk_grid"]["configuration"]["chunk_shape"]),
            format!("{} {}", plain(&codec["name"]), plain(&codec["configuration"]["endian"])),
            plain(&found["fill_value"]),
            plain(&found["attributes"]["units"]),
            plain(&found["attributes"]["long_name"]),
        ];
        let cells = [&row[1], &sizes(&row[2]), &row[3], &sizes(&row[4]), &row[5], &row[6], code(&row[8]), &row[9]];
        assert_eq!(written.each_ref().map(String::as_str), cells.map(|cell| cell as &str), "{}", row[0]);
    }
    assert_eq!(arrays["material"]["attributes"]["flag_meanings"], "grey black");
    let layers: Value = serde_json::from_str(group["attributes"]["layers"].as_str().expect("text")).expect("JSON");
    assert_eq!(layers["objects"], serde_json::json!(["objects.0", "objects.1"]));
    assert_eq!(layers.as_object().map(|all| all.len()), Some(3));
    // 136 + 16 K without, and the last record of each tile.
    let bytes = std::fs::read(path.join(".spectile/journal/1")).expect("a journal");
    let size = 136 + 96 + 16 * 5;
    assert!(bytes.len().is_multiple_of(size), "{}", bytes.len());
    let record = &bytes[bytes.len() - size..];
    for (i, row) in documented.iter().enumerate() {
        let file = code(&row[7]).replace("ROW", "0").replace("COLUMN", "1");
        let sum = u128::from_le_bytes(record[120 + 16 * i..][..16].try_into().expect("sixteen bytes"));
        assert_eq!(sum, xxh3_128(&std::fs::read(path.join(&file)).expect("a file")), "{file}");
    }
}

fn choices_have_the_fields_of_the_page(cubes: &Cubes) {
    let found = json(&cubes.path("plain").join(".spectile/choices.json"));
    let documented = rows("Choices");
    for row in &documented {
        let (name, kind) = (code(&row[0]), &row[1]);
        assert!(is_a(&found[name], kind), "{name} is {}, in docs/cube.md {kind}", found[name]);
    }
    let there: BTreeSet<&String> = found.as_object().expect("an object").keys().collect();
    assert_eq!(there.len(), documented.len(), "{there:?}");
}

fn arrays_are_those_of_the_page(cubes: &Cubes) {
    let documented: BTreeMap<String, Vec<String>> =
        rows("Arrays").into_iter().map(|row| (code(&row[0]).to_owned(), row[1..].to_vec())).collect();
    let mut seen = BTreeSet::new();
    for name in cubes.names {
        let arrays = cubes.arrays(name);
        let (width, height, channels) = (24u64, 20u64, arrays["wavelength"]["shape"][0].as_u64().expect("K"));
        let letter = |word: &str| -> String {
            let value = match word {
                "K" => channels,
                "W" => width,
                "H" => height,
                "w" | "h" => TILE,
                "⌈W/w⌉" => width.div_ceil(TILE),
                "⌈H/h⌉" => height.div_ceil(TILE),
                "⌈W/8⌉" => width.div_ceil(8),
                "⌈H/8⌉" => height.div_ceil(8),
                "⌈w/8⌉" | "⌈h/8⌉" => TILE / 8,
                number => number.parse().unwrap_or_else(|_| panic!("`{number}` is no size")),
            };
            value.to_string()
        };
        let numbers = |cell: &str| cell.split(", ").map(letter).collect::<Vec<_>>().join(", ");
        for (array, found) in &arrays {
            let row = documented.get(array).unwrap_or_else(|| panic!("docs/cube.md has no array `{array}`"));
            let codecs: Vec<String> = (found["codecs"].as_array().expect("codecs").iter())
                .map(|codec| match &codec["configuration"] {
                    order if order["order"].is_array() => {
                        format!("{} [{}]", plain(&codec["name"]), list(&order["order"]))
                    }
                    bytes => format!("{} {}", plain(&codec["name"]), plain(&bytes["endian"])),
                })
                .collect();
            let chunk = &found["chunk_grid"]["configuration"]["chunk_shape"];
            let written = [
                list(&found["dimension_names"]),
                list(&found["shape"]),
                plain(&found["data_type"]),
                list(chunk),
                codecs.join(", "),
                plain(&found["fill_value"]),
            ];
            let page =
                [row[0].clone(), numbers(&row[1]), row[2].clone(), numbers(&row[3]), row[4].clone(), row[5].clone()];
            assert_eq!(written, page, "array `{array}` of {name}.zarr, and its row in docs/cube.md");
            assert_eq!(json(&cubes.path(name).join(array).join("zarr.json")), *found, "{array} by itself");
            seen.insert(array.clone());
        }
        assert_eq!(arrays.contains_key("standard_error"), name == "uncertainty", "{name}");
    }
    assert_eq!(seen, documented.into_keys().collect(), "arrays that were written, and those of docs/cube.md");
}

fn attributes_of_arrays_are_those_of_the_page(cubes: &Cubes) {
    let documented: BTreeMap<(String, String), String> = (rows("Attributes of arrays").into_iter())
        .map(|row| ((code(&row[0]).to_owned(), code(&row[1]).to_owned()), row[2].clone()))
        .collect();
    let mut seen = BTreeSet::new();
    for name in cubes.names {
        for (array, found) in cubes.arrays(name) {
            for (attribute, value) in found["attributes"].as_object().expect("attributes") {
                let key = (array.clone(), attribute.clone());
                let page = documented.get(&key).unwrap_or_else(|| panic!("docs/cube.md has no {key:?}"));
                let value = value.as_str().expect("a string");
                assert!(!page.starts_with('`') || code(page) == value, "{key:?}: `{value}`, in docs/cube.md {page}");
                seen.insert(key);
            }
        }
    }
    assert_eq!(seen, documented.into_keys().collect(), "attributes that were written, and those of docs/cube.md");
}

/// The leaves of an object by dotted path.
fn leaves(prefix: &str, value: &Value, found: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                leaves(&path, value, found);
            }
        }
        leaf => _ = found.insert(prefix.to_owned(), leaf.clone()),
    }
}

fn is_a(value: &Value, kind: &str) -> bool {
    kind.split(" or ").any(|kind| match kind {
        "string" => value.is_string(),
        "integer" => value.is_u64(),
        "number" => value.is_number(),
        "boolean" => value.is_boolean(),
        "list" => value.is_array(),
        "object" => value.is_object(),
        "null" => value.is_null(),
        _ => panic!("docs/cube.md: `{kind}` is no type"),
    })
}

fn attributes_of_the_group_are_those_of_the_page(cubes: &Cubes) {
    let documented = rows("Attributes of the group");
    for name in cubes.names {
        let group = cubes.group(name);
        let keys: BTreeSet<&str> = group.as_object().expect("an object").keys().map(String::as_str).collect();
        let expected = ["attributes", "consolidated_metadata", "node_type", "zarr_format"];
        assert_eq!(keys, BTreeSet::from(expected), "{name}");
        let mut found = BTreeMap::new();
        let mut attributes = group["attributes"].clone();
        for value in attributes.as_object_mut().expect("attributes").values_mut() {
            let is_flat = |value: &Value| value.is_number() || value.is_string();
            assert!(is_flat(value) || value.as_array().is_some_and(|items| items.iter().all(is_flat)), "{value}");
            // What has more structure is JSON as text.
            let structured = value.as_str().filter(|text| text.starts_with(['{', '[']));
            if let Some(inner) = structured.map(|text| serde_json::from_str(text).expect("JSON")) {
                *value = inner;
            }
        }
        leaves("", &attributes, &mut found);
        let mut expected = BTreeSet::new();
        for row in &documented {
            let [path, kind, cubes] = [code(&row[0]), &row[1], &row[2]];
            if cubes.split(", ").any(|of| of == "all" || of == name) {
                let value = found.get(path).unwrap_or_else(|| panic!("{name}.zarr has no `{path}` of docs/cube.md"));
                assert!(is_a(value, kind), "`{path}` is {value}, in docs/cube.md {kind}");
                expected.insert(path.to_owned());
            }
        }
        let there: BTreeSet<String> = found.into_keys().collect();
        assert_eq!(there, expected, "attributes of {name}.zarr, and those of docs/cube.md");
    }
    // What the page says of the values themselves.
    let attributes = &cubes.group("plain")["attributes"];
    let said = |path: &str| documented.iter().find(|row| code(&row[0]) == path).expect("a row")[3].clone();
    assert!(said("Conventions").contains(&format!("`{}`", attributes["Conventions"].as_str().expect("a string"))));
    assert!(said("spectile_format").ends_with(&format!(": {}", attributes["spectile_format"])));
    assert_eq!(attributes["origin"], serde_json::json!([2, 3]));
}

/// Whether a name is what a pattern of the page stands for.
fn matches(pattern: &str, name: &str, arrays: &BTreeSet<String>) -> bool {
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let random = |text: &str| text.bytes().all(|byte| byte.is_ascii_alphanumeric());
    let is_array = |text: &str| arrays.contains(text);
    type Known<'a> = (&'a str, &'a dyn Fn(&str) -> bool);
    let words: [Known; 5] =
        [("ROW", &digits), ("COLUMN", &digits), ("TILE", &digits), ("SUFFIX", &random), ("ARRAY", &is_array)];
    for (word, is_one) in words {
        if let Some(rest) = pattern.strip_prefix(word) {
            let ends = (1..=name.len()).filter(|&end| name.is_char_boundary(end));
            return ends.filter(|&end| is_one(&name[..end])).any(|end| matches(rest, &name[end..], arrays));
        }
    }
    match (pattern.chars().next(), name.chars().next()) {
        (None, None) => true,
        (Some(a), Some(b)) if a == b => matches(&pattern[a.len_utf8()..], &name[b.len_utf8()..], arrays),
        _ => false,
    }
}

fn files_of(root: &Path) -> Vec<String> {
    let (mut found, mut open) = (Vec::new(), vec![root.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.push(path.strip_prefix(root).expect("inside").to_str().expect("UTF-8").replace('\\', "/"));
            }
        }
    }
    found
}

fn files_are_those_of_the_page(cubes: &Cubes) {
    let documented: Vec<(String, String)> =
        rows("Files").into_iter().map(|row| (code(&row[0]).to_owned(), row[1].clone())).collect();
    let arrays: BTreeSet<String> = rows("Arrays").iter().map(|row| code(&row[0]).to_owned()).collect();
    let of = |name: &str| {
        let pattern = documented.iter().find(|(pattern, _)| matches(pattern, name, &arrays));
        pattern.unwrap_or_else(|| panic!("docs/cube.md has no file `{name}`"))
    };
    for name in cubes.names {
        let seen: BTreeSet<&String> = files_of(&cubes.path(name)).iter().map(|file| &of(file).0).collect();
        for (pattern, there) in documented.iter().filter(|(_, there)| there == "always" || there == name) {
            // What was made of another cube was not rendered.
            let no_run = name == "sensor" && ["/run-", "/choices"].iter().any(|file| pattern.contains(file));
            assert!(
                seen.contains(pattern) || no_run,
                "{name}.zarr has no `{pattern}`, which docs/cube.md says is there {there}"
            );
        }
    }
    // Merged and not yet committed.
    let path = cubes.path("uncommitted");
    let header = Cube::open(&cubes.path("uncertainty")).expect("a cube").header().clone();
    let unit = vec![0.5; header.grid().tile_pixels() * header.channels.len()];
    let writer = Writer::open(&path, &header, Existing::Refuse, 0..header.grid().count(), &mut |what| panic!("{what}"));
    let writer = writer.expect("a new cube");
    writer.merge_unit(1, 0, 1, &unit).expect("merged");
    let seen: BTreeSet<&String> = files_of(&path).iter().map(|file| &of(file).0).collect();
    assert!(documented.iter().filter(|(_, there)| there == "rendering").all(|(pattern, _)| seen.contains(pattern)));
    let of_submit = slurm::folder(Path::new("")).join("job.json");
    assert_eq!(of(of_submit.to_str().expect("UTF-8")).1, "submitted");
}

/// The records of every tile, read by the offsets of the page: what they say of the files is so, and the error estimate that the
/// page makes of them is that of `info`.
fn journals_are_laid_out_as_the_page_says(cubes: &Cubes) {
    const K: usize = 5;
    let fields: Vec<(usize, usize, String)> = rows("Commits")
        .into_iter()
        .map(|row| {
            let size = |cell: &str| -> usize {
                let term = |term: &str| match term.strip_suffix('K') {
                    Some(factor) => factor.trim().parse::<usize>().expect("a factor") * K,
                    None => term.trim().parse().expect("a number"),
                };
                cell.split('+').map(term).sum()
            };
            (size(&row[0]), size(&row[1]), row[3].clone())
        })
        .collect();
    let record_bytes = fields.windows(2).fold(fields[0].1, |end, pair| {
        assert_eq!(pair[1].0, end, "{}", pair[1].2);
        end + pair[1].1
    });
    let said = |bytes: usize| PAGE.contains("136 + 16 K bytes each") && bytes == 136 + 16 * K;
    assert!(said(record_bytes));
    for name in ["plain", "uncertainty"] {
        let path = cubes.path(name);
        let (mut variance, mut square) = ([0.0; K], [0.0; K]);
        for tile in 0..4u32 {
            let bytes = std::fs::read(path.join(".spectile/journal").join(tile.to_string())).expect("a journal");
            assert!(bytes.len().is_multiple_of(record_bytes) && bytes.len() <= 16 * record_bytes, "{}", bytes.len());
            let record = &bytes[bytes.len() - record_bytes..];
            let field = |words: &str| {
                let of = fields.iter().find(|(_, _, content)| content.starts_with(words));
                let (from, length, _) = of.unwrap_or_else(|| panic!("docs/cube.md has no field `{words}`"));
                &record[*from..from + length]
            };
            let word = |words: &str| u32::from_le_bytes(field(words).try_into().expect("four bytes"));
            assert_eq!(field("`SPTJRNL2`"), b"SPTJRNL2");
            // Nobody has looked.
            assert_eq!(
                field("the tile's [error]"),
                [f32::INFINITY.to_le_bytes(), f32::INFINITY.to_le_bytes()].concat()
            );
            assert_eq!((word("TILE"), word("K"), word("samples per pixel")), (tile, K as u32, 128));
            // 1, 1, 2, 4, 8, 16, 32, and 64: the eighth has index 7.
            assert_eq!(word("index of the last [epoch]"), 7);
            let sum = |words: &str| u128::from_le_bytes(field(words).try_into().expect("sixteen bytes"));
            assert_eq!(sum("XXH3-128 of all before"), xxh3_128(&record[..record_bytes - 16]));
            let [column, row] = [tile % 2, tile / 2];
            for (words, file) in [
                ("XXH3-128 of the tile's file of `radiance`", format!("radiance/c/0/{row}/{column}")),
                ("of `samples`", format!("samples/c/{row}/{column}")),
                ("of `preview`", format!("preview/c/{row}/{column}/0")),
                ("of `overview`", format!("overview/c/0/{row}/{column}")),
                ("of `standard_error`", format!("standard_error/c/0/{row}/{column}")),
            ] {
                let expected = std::fs::read(path.join(&file)).map_or(0, |bytes| xxh3_128(&bytes));
                assert_eq!(sum(words), expected, "{name} {file}");
            }
            let doubles = |words: &str| -> Vec<f64> {
                field(words).as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
            };
            let (spread, mean2) =
                (doubles("of each channel Σ over pixels of M2"), doubles("of each channel Σ over pixels of mean²"));
            for k in 0..K {
                // Two full epochs.
                variance[k] += spread[k] / 2.0;
                square[k] += mean2[k];
            }
        }
        let output = spectile(cubes.folder.path(), &["info", &format!("{name}.zarr"), "--json"], false);
        let info: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        for k in 0..K {
            let estimate = info["channels"][k]["error_estimate"].as_f64().expect("a number");
            let by_page = f64::sqrt(variance[k] / square[k]);
            assert!((estimate / by_page - 1.0).abs() < 1e-12, "{estimate} {by_page}");
        }
    }
}

fn runs_have_the_facts_of_the_page(cubes: &Cubes) {
    let mut documented: BTreeMap<String, String> = BTreeMap::new();
    for row in rows("Facts of a run") {
        // Several fields may share a row; and a type, if it is one.
        let names: Vec<&str> = row[0].split(", ").map(code).collect();
        let kinds: Vec<&str> = row[1].split(", ").collect();
        for (i, name) in names.iter().enumerate() {
            documented.insert((*name).to_owned(), kinds[i.min(kinds.len() - 1)].to_owned());
        }
    }
    for name in ["plain", "responses"] {
        let folder = cubes.path(name).join(".spectile");
        let runs: Vec<String> = files_of(&folder).into_iter().filter(|file| file.starts_with("run-")).collect();
        assert_eq!(runs.len(), 1);
        let run = json(&folder.join(&runs[0]));
        let fields = run.as_object().expect("an object");
        let keys: BTreeSet<&String> = fields.keys().collect();
        assert_eq!(keys, documented.keys().collect(), "facts of a run, and those of docs/cube.md");
        for (key, value) in fields {
            assert!(is_a(value, &documented[key]), "`{key}` is {value}, in docs/cube.md {}", documented[key]);
        }
        assert_eq!((run["state"].as_str(), run["tiles"].clone()), (Some("done"), serde_json::json!([0, 4])));
    }
}
