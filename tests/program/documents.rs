//! What documents say is so: links lead somewhere, what comments point at is there, the README's scene is one, and its tour can be
//! walked in its own order.

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::tempdir;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Files below `folder` with one of these endings, but for what is made or installed.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            if !["generated", "node_modules", "vendor"].contains(&&*name) {
                found.extend(files(&path, endings));
            }
        } else if endings.iter().any(|ending| name.ends_with(ending)) {
            found.push(path);
        }
    }
    found
}

/// The project's own pages.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![root().join("README.md"), root().join("ARCHITECTURE.md")];
    for folder in ["docs", "scenes", "tests", "benches", "examples", "python"] {
        pages.extend(files(&root().join(folder), &[".md"]));
    }
    pages
}

fn headings(page: &str) -> Vec<&str> {
    page.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim()).collect()
}

/// The anchor of a heading as GitHub makes it.
fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect::<String>();
    kept.replace(' ', "-")
}

#[test]
fn links_lead_somewhere() {
    let (mut broken, mut links) = (Vec::new(), 0);
    for page in pages() {
        let text = read(&page);
        for (before, rest) in text.match_indices("](").map(|(at, _)| text.split_at(at + 2)) {
            let target = rest.split(')').next().expect("something");
            if target.starts_with("https://") {
                continue;
            }
            links += 1;
            let (file, place) = target.split_once('#').map_or((target, None), |(file, place)| (file, Some(place)));
            let path = if file.is_empty() { page.clone() } else { page.parent().expect("a folder").join(file) };
            let is_there = path.exists()
                && place.is_none_or(|place| headings(&read(&path)).iter().any(|heading| anchor(heading) == place));
            if !is_there {
                broken.push(format!("{}:{}: {target}", page.display(), before.lines().count()));
            }
        }
    }
    assert!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
    assert!(links > 40, "only {links} links seen");
}

/// Comments name pages as `docs/PAGE.md`, and a chapter of one as `docs/PAGE.md, Chapter`.
#[test]
fn what_comments_point_at_is_there() {
    let (mut wrong, mut seen) = (Vec::new(), BTreeSet::new());
    for folder in ["src", "shaders", "tests", "benches", "examples", "scripts", "python"] {
        for file in files(&root().join(folder), &[".rs", ".wgsl", ".py", ".sh", ".js"]) {
            if file.ends_with(file!()) {
                continue;
            }
            // Comments in one line each.
            let text = read(&file);
            let lines = text.lines().map(|line| line.trim_start().trim_start_matches(['/', '!', '#']).trim());
            let text = lines.collect::<Vec<_>>().join(" ");
            for (_, rest) in text.match_indices("docs/").map(|(at, _)| text.split_at(at)) {
                let Some(end) = rest.find(".md").filter(|&end| !rest[..end].contains([' ', '{', '"'])) else {
                    continue;
                };
                let (page, after) = rest.split_at(end + 3);
                seen.insert(page.to_owned());
                let chapter = after.strip_prefix(", ").filter(|chapter| chapter.starts_with(char::is_uppercase));
                let is_there = root().join(page).exists()
                    && chapter.is_none_or(|chapter| headings(&read(page)).iter().any(|h| chapter.starts_with(h)));
                if !is_there {
                    wrong.push(format!("{}: {}", file.display(), &rest[..rest.len().min(60)]));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "pages and chapters that are not there:\n{}", wrong.join("\n"));
    assert!(seen.contains("docs/METHOD.md") && seen.len() >= 3, "{seen:?}");
}

#[test]
fn the_readme_is_short_and_names_the_paper_first() {
    let readme = read("README.md");
    assert!(readme.lines().count() <= 150, "{} lines: what is longer belongs into docs/", readme.lines().count());
    let first = readme.split("\n\n").nth(1).expect("a paragraph");
    for words in
        ["Hoarau", "Interactive Hyper Spectral Image Rendering on GPU", "https://doi.org/10.48663/1860-2037/15.2018.4"]
    {
        assert!(first.contains(words), "{words} is not in the first paragraph: {first}");
    }
}

fn spectile(folder: &Path, words: &[String]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
    // The Vulkan loader wants one, and would say so on stderr.
    command.env("XDG_RUNTIME_DIR", folder).current_dir(folder).args(words);
    command
}

fn succeed(mut command: Command) -> Output {
    let output = command.output().expect("it runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{errors}", output.status);
    output
}

#[test]
fn the_readmes_scene_is_one() {
    let readme = read("README.md");
    let scene = readme.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a scene");
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("ball.toml"), scene).expect("written");
    let words = ["render", "ball.toml", "-o", "ball.zarr", "--spp", "1", "--size", "16x16"];
    succeed(spectile(folder.path(), &words.map(str::to_owned)));
}

/// The tour's commands, without `./run`.
fn tour() -> Vec<Vec<String>> {
    let readme = read("README.md");
    let chapter = readme.split("## A first tour\n").nth(1).and_then(|rest| rest.split("\n## ").next()).expect("a tour");
    let lines = chapter.lines().filter_map(|line| line.strip_prefix("    ./run "));
    lines.map(|line| shlex::split(line).unwrap_or_else(|| panic!("no shell reads this: {line}"))).collect()
}

/// The same command at a cost that a test can bear: fewer samples, seconds and pixels, one case, two evaluators, and any port that is
/// free. Files keep their names, so what a line leaves is what the next ones find.
fn cheaper(words: &[String]) -> Vec<String> {
    let mut words = words.to_vec();
    for i in 1..words.len() {
        let value = match &*words[i - 1] {
            "--spp" => (words[i].parse::<u32>().expect("a number") / 64).max(1).to_string(),
            "--time" => "1s".into(),
            "--size" => "8x8".into(),
            "--listen" => "127.0.0.1:0".into(),
            _ => continue,
        };
        words[i] = value;
    }
    let more: &[&str] = match &*words[0] {
        "view" => &["--listen", "127.0.0.1:0"],
        "stress" => &["--case", "two-nodes"],
        "converge" => &["--budget", "1s", "--spp", "4"],
        "bench" => &["--channels", "8", "--evaluators", "dpept-pixel,pt", "--rounds", "1", "--budget", "0.1s"],
        _ => &[],
    };
    words.extend(more.iter().map(|&word| word.to_owned()));
    words
}

/// Looks at the page that `view` serves, and ends it as Ctrl-C does.
fn look_and_leave(mut view: Command) {
    let mut child = view.stdout(Stdio::piped()).spawn().expect("it runs");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("piped")).read_line(&mut line).expect("it says where");
    let host = line.split("http://").nth(1).and_then(|rest| rest.split('/').next()).expect("an address").to_owned();
    let mut page = TcpStream::connect(&host).expect("it listens");
    write!(page, "GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").expect("asked");
    let mut answer = String::new();
    page.read_to_string(&mut answer).expect("answered");
    assert!(answer.starts_with("HTTP/1.1 200 ") && answer.contains("<html"), "{answer}");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(sent.success());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
}

#[test]
fn the_tour_works_in_its_own_order() {
    let folder = tempdir().expect("a folder");
    let scene = folder.path().join("scenes/cornell");
    fs::create_dir_all(&scene).expect("created");
    for file in files(&root().join("scenes/cornell"), &[".toml", ".csv", ".obj"]) {
        fs::copy(&file, scene.join(file.file_name().expect("a name"))).expect("copied");
    }
    // The box in fewer channels: cubes of 20 MB instead of 100.
    let toml = read("scenes/cornell/cornell.toml");
    let fewer = toml.replace("count = 400", "count = 80");
    assert_ne!(toml, fewer, "the box has 400 channels no more");
    fs::write(scene.join("cornell.toml"), fewer).expect("written");

    let tour = tour();
    for words in &tour {
        if !cfg!(feature = "web") && words.iter().any(|word| word == "view" || word == "--listen") {
            eprintln!("skipped: {words:?}, as this build has no web page");
            continue;
        }
        let words = cheaper(words);
        let command = spectile(folder.path(), &words);
        if words[0] == "view" {
            look_and_leave(command);
        } else {
            succeed(command);
        }
        for pair in words.windows(2).filter(|pair| ["-o", "--preview", "--plot"].contains(&&*pair[0])) {
            assert!(folder.path().join(&pair[1]).exists(), "{words:?} leaves no {}", pair[1]);
        }
    }
    let commands: BTreeSet<&str> = tour.iter().map(|words| &*words[0]).collect();
    assert!(tour.len() >= 15 && commands.len() >= 10, "a short tour: {commands:?}");
    python_opens_it(folder.path());
}

/// The README's lines of Python, in the folder of the tour; the values instead of a plot of them, which needs more installed.
fn python_opens_it(folder: &Path) {
    let Some(python) = std::env::var_os("SPECTILE_PYTHON").filter(|python| !python.is_empty()) else {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "CI must set SPECTILE_PYTHON");
        eprintln!("skipped: the README's Python, as SPECTILE_PYTHON names none with xarray and zarr");
        return;
    };
    let readme = read("README.md");
    let from = readme.find("    import xarray\n").expect("lines of Python");
    let lines: Vec<&str> = readme[from..].lines().map_while(|line| line.strip_prefix("    ")).collect();
    let program = lines.join("\n").replace(".plot()", ".load()");
    let mut command = Command::new(python);
    command.current_dir(folder).args(["-c", &program]);
    succeed(command);
}
