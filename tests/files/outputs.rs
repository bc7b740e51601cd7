//! What commands write goes to a new name, or replaces a file or folder of the same product; links, pipes, devices and the
//! standard output; and nothing of anybody else's is ever touched. Through the real binary.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::cube_files::files;
use crate::cubes::{Random, create, header, patterned, unit};
use tempfile::{TempDir, tempdir};

const SCENE: &str = "\
[camera.orthographic]
position = [0.0, 0.0, 5.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
width = 2.0
[film]
width = 8
height = 8
[channels]
equal = { from = 400.0, to = 700.0, count = 3 }
[integrator]
max_bounces = 0
[materials.picture.diffuse]
reflectance = { texture = \"picture.png\" }
[[objects]]
quad = { corner = [-2.0, -2.0, 0.0], edge_u = [4.0, 0.0, 0.0], edge_v = [0.0, 4.0, 0.0] }
material = \"picture\"
emission = 1.0
";

struct Place(TempDir);

impl Place {
    /// A folder with a cube and a scene.
    fn new() -> Place {
        let place = Place(tempdir().expect("folder"));
        drop(patterned(place.0.path(), "cube.zarr", header([9, 5], [8, 8], 3)));
        fs::write(place.at("scene.toml"), SCENE).expect("written");
        place
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
        command.current_dir(self.0.path()).args(arguments).env("XDG_RUNTIME_DIR", self.0.path());
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("runs")
    }

    fn succeeds(&self, arguments: &[&str]) -> Output {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        output
    }

    /// Refused with exit code 2, in one sentence that has `words`, and not a byte of anything is changed.
    fn refuses(&self, arguments: &[&str], words: &str) {
        let before = self.everything();
        let output = self.run(arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
        assert!(errors.len() == 1 && errors[0].contains(words), "{arguments:?}: {stderr}");
        assert!(self.everything() == before, "{arguments:?}");
    }

    /// Kinds, modes and content of all that is there.
    fn everything(&self) -> Vec<(PathBuf, u32, Vec<u8>)> {
        fn walk(folder: &Path, found: &mut Vec<(PathBuf, u32, Vec<u8>)>) {
            for entry in fs::read_dir(folder).expect("list") {
                let path = entry.expect("an entry").path();
                let is = fs::symlink_metadata(&path).expect("there");
                let content = match () {
                    () if is.is_file() => fs::read(&path).expect("read"),
                    () if is.is_symlink() => {
                        fs::read_link(&path).expect("a link").into_os_string().into_encoded_bytes()
                    }
                    () => Vec::new(),
                };
                if is.is_dir() {
                    walk(&path, found);
                }
                found.push((path, is.permissions().mode(), content));
            }
        }
        let mut found = Vec::new();
        walk(self.0.path(), &mut found);
        found.sort();
        found
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const EXPORTS: [&str; 6] = ["a.png", "a.img", "a.bsq", "a.exr", "a.csv", "a.zarr"];

/// What somebody might have lying about, under every name that an export may have.
#[test]
fn exports_replace_their_own_kind_and_nothing_else() {
    let place = Place::new();
    let export = |name: &'static str| ["export", "cube.zarr", "-o", name];
    for name in EXPORTS {
        // New, then again: the same bytes, and nothing beside them.
        place.succeeds(&export(name));
        let first = place.everything();
        place.succeeds(&export(name));
        let contents = |all: Vec<(PathBuf, u32, Vec<u8>)>| all.into_iter().map(|f| (f.0, f.2)).collect::<Vec<_>>();
        let again = place.everything();
        assert_eq!(again.len(), first.len(), "{name}");
        // The crate keeps attributes of OpenEXR in an order of their own each time.
        assert!(name == "a.exr" || contents(again) == contents(first), "{name}");
        let is_folder = place.at(name).is_dir();
        if is_folder {
            fs::remove_dir_all(place.at(name)).expect("removed");
        } else {
            fs::remove_file(place.at(name)).expect("removed");
        }
        let _ = fs::remove_file(place.at("a.hdr"));
        // Somebody else's.
        for foreign in ["", "years of work\n", "x,y,z\none,two,three\n", "{\"measured\": 1}", "\u{89}PNG\r\n"] {
            fs::write(place.at(name), foreign).expect("written");
            place.refuses(&export(name), "exists already and is not");
            fs::remove_file(place.at(name)).expect("removed");
        }
        if !is_folder {
            fs::create_dir(place.at(name)).expect("made");
            let output = place.run(&export(name));
            assert_eq!(output.status.code(), Some(5), "{name}: {}", text(&output.stderr));
            fs::remove_dir(place.at(name)).expect("removed");
        }
    }
    place.succeeds(&export("a.csv"));
    fs::set_permissions(place.at("a.csv"), fs::Permissions::from_mode(0o444)).expect("set");
    place.refuses(&export("a.csv"), "is write-protected");
    // Who may read it stays as it was.
    fs::set_permissions(place.at("a.csv"), fs::Permissions::from_mode(0o640)).expect("set");
    place.succeeds(&export("a.csv"));
    assert_eq!(fs::metadata(place.at("a.csv")).expect("there").permissions().mode() & 0o777, 0o640);
}

/// Data and header are one product: neither is written where the other is somebody else's.
#[test]
fn headers_of_other_data_stay() {
    let place = Place::new();
    let export = ["export", "cube.zarr", "-o", "scan.img"];
    let sky = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81";
    fs::write(place.at("scan.hdr"), sky).expect("written");
    place.refuses(&export, "scan.hdr: exists already and is not an ENVI header");
    fs::remove_file(place.at("scan.hdr")).expect("removed");
    // The header of data of another name, and of data that has another size.
    place.succeeds(&["export", "cube.zarr", "-o", "scan.bil"]);
    place.refuses(&export, "scan.hdr is the header of other data");
    place.refuses(&["export", "cube.zarr", "-o", "scan.hdr"], "scan.hdr is the header of other data");
    fs::write(place.at("scan.img"), [0; 17]).expect("written");
    place.refuses(&export, "scan.hdr describes other data");
    fs::remove_file(place.at("scan.hdr")).expect("removed");
    place.refuses(&export, "has no header scan.hdr");
    fs::remove_file(place.at("scan.img")).expect("removed");
    // What GDAL would read instead is told of.
    fs::write(place.at("scan.img.hdr"), "ENVI\n").expect("written");
    let said = text(&place.succeeds(&export).stderr);
    assert!(said.contains("warning: scan.img.hdr is there too: GDAL and QGIS read it"), "{said}");
    assert_eq!(fs::read(place.at("scan.img.hdr")).expect("read"), b"ENVI\n");
    fs::remove_file(place.at("scan.img.hdr")).expect("removed");
    // And what it would take for the header's data, whichever is written last.
    for name in ["scan.exr", "scan.img"] {
        let said = text(&place.succeeds(&["export", "cube.zarr", "-o", name]).stderr);
        assert!(said.contains("warning: scan.hdr and scan.exr have one name"), "{name}: {said}");
    }
}

#[test]
fn names_of_other_formats_are_refused() {
    let place = Place::new();
    for (name, format) in [
        ("a.jpg", "png"),
        ("a.csv", "png"),
        ("a.png", "csv"),
        ("a.zarr", "csv"),
        ("a.tif", "envi"),
        ("a.exr", "envi"),
        ("a.nc", "zarr"),
        ("a.HDR", "exr"),
    ] {
        place.refuses(&["export", "cube.zarr", "-o", name, "--format", format], "under this name would be taken for");
    }
    place.succeeds(&["export", "cube.zarr", "-o", "picture.png"]);
    let render = ["render", "scene.toml", "-o"];
    place.refuses(&[&render[..], &["o.png"]].concat(), "a cube under this name would be taken for");
    place.refuses(&[&render[..], &["o.zarr", "--preview", "view.jpg"]].concat(), "use .png");
    place.refuses(&["spectrum", "cube.zarr", "1", "1", "--plot", "a.png"], "use .svg");
    let responses = "nm,a\n400,1\n700,1\n";
    fs::write(place.at("r.csv"), responses).expect("written");
    place.refuses(&["sensor", "cube.zarr", "--responses", "r.csv", "-o", "s.csv"], "a cube under this name");
}

#[test]
fn links_lead_to_what_is_meant() {
    let place = Place::new();
    fs::create_dir(place.at("real")).expect("made");
    let export = |name: &'static str| ["export", "cube.zarr", "-o", name];
    for name in EXPORTS {
        // To nothing: what is behind is made. Then it is there, and replaced.
        symlink(format!("real/{name}"), place.at(name)).expect("linked");
        for _ in 0..2 {
            place.succeeds(&export(name));
            assert!(place.at(name).is_symlink() && place.at(&format!("real/{name}")).exists(), "{name}");
        }
        fs::remove_file(place.at(name)).expect("removed");
        let _ = fs::remove_file(place.at("a.hdr"));
    }
    // The rule is the same behind a link, and behind a link to a link.
    fs::write(place.at("real/notes"), "years of work").expect("written");
    symlink("real/notes", place.at("one")).expect("linked");
    symlink("one", place.at("two.csv")).expect("linked");
    place.refuses(&export("two.csv"), "two.csv: exists already and is not a table");
    symlink("round.csv", place.at("round.csv")).expect("linked");
    let output = place.run(&export("round.csv"));
    assert_eq!((output.status.code(), place.at("round.csv").is_symlink()), (Some(5), true));
    let entries = fs::read_dir(place.at("real")).expect("list").map(|e| e.expect("an entry").file_name());
    assert!(entries.into_iter().all(|name| !text(name.as_encoded_bytes()).starts_with('.')));
}

fn fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo").success());
}

#[test]
fn pipes_devices_and_the_standard_output_take_streams() {
    let place = Place::new();
    place.succeeds(&["export", "cube.zarr", "-o", "a.csv"]);
    place.succeeds(&["export", "cube.zarr", "-o", "a.png"]);
    fifo(&place.at("pipe"));
    symlink("/proc/self/fd/1", place.at("stdout")).expect("linked");
    for (format, file) in [("csv", "a.csv"), ("png", "a.png")] {
        let expected = fs::read(place.at(file)).expect("read");
        // By every name that the standard output has; what is said goes elsewhere.
        for name in ["-", "stdout", "/dev/stdout"] {
            let output = place.succeeds(&["export", "cube.zarr", "-o", name, "--format", format]);
            assert!(output.stdout == expected, "{name}");
            assert!(text(&output.stderr).contains("9 x 5 pixels"), "{}", text(&output.stderr));
        }
        let into = fs::File::create(place.at("redirected")).expect("made");
        let mut command = place.command(&["export", "cube.zarr", "-o", "/dev/stdout", "--format", format]);
        assert!(command.stdout(into).stderr(Stdio::null()).status().expect("runs").success());
        assert!(fs::read(place.at("redirected")).expect("read") == expected);

        let reader = Command::new("cat").arg(place.at("pipe")).stdout(Stdio::piped()).spawn().expect("cat");
        place.succeeds(&["export", "cube.zarr", "-o", "pipe", "--format", format]);
        assert!(reader.wait_with_output().expect("read").stdout == expected);
        place.succeeds(&["export", "cube.zarr", "-o", "/dev/null", "--format", format]);
    }
    assert!(fs::symlink_metadata(place.at("pipe")).expect("there").file_type().is_fifo());
    assert!(place.at("stdout").is_symlink());
    assert!(fs::metadata("/dev/null").expect("there").file_type().is_char_device());
    // Whoever reads no further has what he wants.
    let mut command = place.command(&["export", "cube.zarr", "-o", "-", "--format", "csv"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    drop(child.stdout.take());
    let ended = child.wait_with_output().expect("ends");
    assert!(ended.status.success() && !text(&ended.stderr).contains("error"), "{}", text(&ended.stderr));

    place.refuses(&["export", "cube.zarr", "-o", "-", "--format", "csv", "--json"], "--json and -o -");
    place.refuses(&["export", "cube.zarr", "-o", "-"], "--format csv");
    for format in ["envi", "exr", "zarr"] {
        place.refuses(&["export", "cube.zarr", "-o", "-", "--format", format], "standard output cannot hold");
        place.refuses(&["export", "cube.zarr", "-o", "pipe", "--format", format], "a pipe cannot hold");
        place.refuses(&["export", "cube.zarr", "-o", "/dev/zero", "--format", format], "a device cannot hold");
    }
    let socket = std::os::unix::net::UnixListener::bind(place.at("socket")).expect("bound");
    place.refuses(&["export", "cube.zarr", "-o", "socket", "--format", "csv"], "is a socket");
    drop(socket);
}

#[test]
fn plots_follow_the_rule() {
    let place = Place::new();
    let plot = |file: &'static str| ["spectrum", "cube.zarr", "1", "1", "--plot", file];
    place.succeeds(&plot("a.svg"));
    place.succeeds(&plot("a.svg"));
    fs::write(place.at("logo.svg"), "<svg xmlns=\"http://www.w3.org/2000/svg\"/>").expect("written");
    place.refuses(&plot("logo.svg"), "exists already and is not a plot of a spectrum");
    place.refuses(&plot("-"), "the values go to the standard output");
    fifo(&place.at("pipe"));
    let reader = Command::new("cat").arg(place.at("pipe")).stdout(Stdio::piped()).spawn().expect("cat");
    place.succeeds(&plot("pipe"));
    assert!(reader.wait_with_output().expect("read").stdout == fs::read(place.at("a.svg")).expect("read"));
}

#[test]
fn nothing_else_is_written_into_a_cube() {
    let place = Place::new();
    place.succeeds(&["export", "cube.zarr", "-o", "picture.png"]);
    symlink("cube.zarr/radiance", place.at("inside")).expect("linked");
    for name in ["cube.zarr/spectrum.csv", "cube.zarr/radiance/spectrum.csv", "inside/spectrum.csv"] {
        let arguments = ["export", "cube.zarr", "-o", name];
        place.refuses(&arguments, "lies in the cube ");
    }
    place.refuses(&["render", "scene.toml", "-o", "cube.zarr/new.zarr", "--spp", "1"], "lies in the cube ");
    place.refuses(&["export", "cube.zarr", "-o", "cube.zarr/picture.png"], "lies in the cube ");
}

/// All of these are refused before a device is opened.
#[test]
fn previews_and_cubes_follow_the_rule() {
    let place = Place::new();
    let preview = |file: &'static str| ["render", "scene.toml", "-o", "o.zarr", "--spp", "1", "--preview", file];
    place.succeeds(&["export", "cube.zarr", "-o", "picture.png"]);
    place.refuses(&preview("picture.png"), "the scene is read from this file");
    symlink("picture.png", place.at("link.png")).expect("linked");
    place.refuses(&preview("link.png"), "the scene is read from this file");
    place.refuses(&preview("scene.toml"), "use .png");
    fs::copy(place.at("scene.toml"), place.at("scene")).expect("copied");
    place.refuses(&["render", "scene", "-o", "o.zarr", "--preview", "scene"], "is not a PNG picture");
    fs::write(place.at("notes.png"), "years of work").expect("written");
    place.refuses(&preview("notes.png"), "exists already and is not a PNG picture");
    fifo(&place.at("pipe"));
    place.refuses(&preview("pipe"), "a pipe cannot hold");
    place.refuses(&preview("/dev/null"), "a device cannot hold");
    place.refuses(&preview("-"), "standard output cannot hold");
    place.refuses(&["render", "scene.toml", "-o", "o", "--preview", "o"], "cannot have one name");
    // Cubes.
    for output in ["-", "pipe", "/dev/null", "scene", "notes.png", "cube.zarr"] {
        let before = place.everything();
        for more in [&[][..], &["--overwrite"], &["--resume"]] {
            let output = place.run(&[&["render", "scene.toml", "--spp", "1", "-o", output], more].concat());
            let stderr = text(&output.stderr);
            assert!(matches!(output.status.code(), Some(2 | 5)), "{output:?} {more:?}: {stderr}");
            if more.is_empty() || stderr.contains("cube.zarr") {
                break;
            }
        }
        assert!(place.everything() == before, "{output}");
    }
}

/// A cube with somebody's array or file in it is not replaced, however it is listed.
#[test]
fn cubes_with_something_of_others_are_not_replaced() {
    let place = Place::new();
    fs::write(place.at("r.csv"), "nm,a\n390,1\n770,1\n").expect("written");
    let sensor = ["sensor", "cube.zarr", "--responses", "r.csv", "-o", "s.zarr"];
    place.succeeds(&sensor);
    place.refuses(&sensor, "exists already");
    let overwrite = [&sensor[..], &["--overwrite"]].concat();
    place.succeeds(&overwrite);
    let group = place.at("s.zarr/zarr.json");
    let whole = fs::read_to_string(&group).expect("read");
    let listed = whole.replacen("\"metadata\": {", "\"metadata\": { \"mask\": {},", 1);
    assert_ne!(listed, whole);
    fs::create_dir(place.at("s.zarr/mask")).expect("made");
    fs::write(&group, listed).expect("written");
    place.refuses(&overwrite, "also holds `mask`");
    fs::remove_dir(place.at("s.zarr/mask")).expect("removed");
    fs::write(place.at("s.zarr/radiance/notes.txt"), "x").expect("written");
    place.refuses(&overwrite, "also holds `notes.txt`");
    fs::remove_file(place.at("s.zarr/radiance/notes.txt")).expect("removed");
    // A copy without what Spectile keeps for itself is one, too.
    fs::remove_dir_all(place.at("s.zarr/.spectile")).expect("removed");
    place.succeeds(&overwrite);
    assert!(place.at("s.zarr/.spectile/cube.json").is_file());
    let names = files(place.0.path(), |name| name.starts_with('.'));
    assert!(names.is_empty(), "{names:?}");
}

#[test]
fn reports_follow_the_rule() {
    let place = Place::new();
    fs::create_dir(place.at("report")).expect("made");
    let stress = ["stress", "--case", "nothing", "-o", "report"];
    // It is the folder that is looked at first where the case is there; here only what is no report is of interest.
    let case = text(&place.succeeds(&["stress", "--list"]).stdout);
    let case = case.split_whitespace().next().expect("a case").to_owned();
    let stress = stress.map(|word| if word == "nothing" { case.as_str() } else { word });
    for (name, content) in [("stress.html", "<html>my page</html>"), ("stress.csv", "a,b\n"), ("stress.json", "{}")] {
        fs::write(place.at("report").join(name), content).expect("written");
        place.refuses(&stress, "exists already and is not a report");
        fs::remove_file(place.at("report").join(name)).expect("removed");
    }
    fs::write(place.at("file"), "x").expect("written");
    for folder in ["file", "-", "/dev/null"] {
        place.refuses(&["stress", "--case", &case, "-o", folder], "is no folder, and a report needs one");
    }
}

/// A limit on the size of files is a full disk: one sentence, exit code 5, nothing left behind.
#[test]
fn a_limit_on_the_size_of_files_is_a_full_disk() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "cube.zarr", header([64, 64], [32, 32], 20));
    let mut random = Random(3);
    for tile in 0..4 {
        cube.merge_unit(tile, 1, &unit(&cube, tile, |_, _, _| random.uniform() as f32)).expect("merged");
    }
    for (name, more) in [
        ("a.csv", &[][..]),
        ("a.img", &[]),
        ("a.bsq", &[]),
        ("a.exr", &[]),
        ("a.zarr", &[]),
        ("a.png", &["--bands", "1,2,3"]),
        ("blocks", &["--format", "envi", "--blocks", "64"]),
    ] {
        // In units of 512 bytes or 1,024.
        let program = format!(
            "ulimit -f 1; exec '{}' export cube.zarr -o {name} {}",
            env!("CARGO_BIN_EXE_spectile"),
            more.join(" ")
        );
        let output = Command::new("sh").args(["-c", &program]).current_dir(folder.path()).output().expect("a shell");
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(5), "{name}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.lines().count() == 1, "{name}: {stderr}");
        assert!(stderr.contains("File too large"), "{name}: {stderr}");
        let left: Vec<_> =
            fs::read_dir(folder.path()).expect("list").map(|e| e.expect("an entry").file_name()).collect();
        assert_eq!(left, ["cube.zarr"], "{name}");
    }
}

/// Old folders are named in Latin-1.
#[cfg(target_os = "linux")]
#[test]
fn paths_need_not_be_utf_8() {
    use std::os::unix::ffi::OsStringExt;
    let place = Place::new();
    let odd = |name: &[u8]| std::ffi::OsString::from_vec(name.to_vec());
    let folder = PathBuf::from(odd(b"d\xfcsen"));
    fs::create_dir(place.0.path().join(&folder)).expect("made");
    fs::write(place.0.path().join(&folder).join("r.csv"), "nm,a\n390,1\n770,1\n").expect("written");
    fs::write(place.0.path().join(&folder).join("scene.toml"), SCENE.replace("{ texture = \"picture.png\" }", "0.5"))
        .expect("written");
    let run = |arguments: &[&std::ffi::OsStr]| {
        let mut command = place.command(&[]);
        let output = command.args(arguments).output().expect("runs");
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let cube = folder.join(odd(b"w\xfcrfel.zarr"));
    fs::rename(place.at("cube.zarr"), place.0.path().join(&cube)).expect("moved");
    let w = |text: &'static str| std::ffi::OsStr::new(text);
    let out = |name: &[u8]| folder.join(odd(name)).into_os_string();
    for json in [false, true] {
        let json: &[&std::ffi::OsStr] = if json { &[w("--json")] } else { &[] };
        for name in [&b"\xe4.png"[..], b"\xe4.img", b"\xe4.exr", b"\xe4.zarr", b"\xe4.csv"] {
            let target = out(name);
            let (code, stdout, stderr) = run(&[&[w("export"), cube.as_os_str(), w("-o"), &target], json].concat());
            assert_eq!(code, Some(0), "{stdout} {stderr}");
            assert!(place.0.path().join(&target).exists());
        }
        let (responses, sensor) = (folder.join("r.csv"), out(b"s\xf6.zarr"));
        for arguments in [
            &[w("info"), cube.as_os_str()][..],
            &[w("info"), w("--verify"), cube.as_os_str()],
            &[w("compare"), cube.as_os_str(), cube.as_os_str()],
            &[
                w("sensor"),
                cube.as_os_str(),
                w("--responses"),
                responses.as_os_str(),
                w("--overwrite"),
                w("-o"),
                &sensor,
            ],
            &[w("plan"), folder.join("scene.toml").as_os_str()],
        ] {
            let (code, stdout, stderr) = run(&[arguments, json].concat());
            assert_eq!(code, Some(0), "{arguments:?}: {stdout} {stderr}");
        }
    }
    let plot = out(b"\xe4.svg");
    let (code, _, stderr) = run(&[w("spectrum"), cube.as_os_str(), w("1"), w("1"), w("--plot"), &plot]);
    assert_eq!(code, Some(0), "{stderr}");
    let blocks = out(b"bl\xf6cke");
    let (code, _, stderr) =
        run(&[w("export"), cube.as_os_str(), w("-o"), &blocks, w("--format"), w("csv"), w("--blocks"), w("4")]);
    assert_eq!(code, Some(0), "{stderr}");
    // Errors name it as well as it can be shown.
    let (code, stdout, stderr) = run(&[w("info"), w("--json"), &out(b"n\xefchts.zarr")]);
    assert_eq!(code, Some(5), "{stderr}");
    assert!(stdout.contains("n\u{fffd}chts.zarr") && stderr.contains("n\u{fffd}chts.zarr"), "{stdout} {stderr}");
    // Slurm's files are text.
    let scene = folder.join("scene.toml");
    let (code, _, stderr) =
        run(&[w("submit"), scene.as_os_str(), w("-o"), w("o.zarr"), w("--spp"), w("1"), w("--dry-run")]);
    assert!(code == Some(2) && stderr.contains("is not UTF-8"), "{stderr}");
}
