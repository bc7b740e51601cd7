//! What cannot work is said at once, in one sentence, and leaves nothing behind.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use super::{Place, SUBMIT, exists, folder_with_scene, text, turn};
use crate::report::{excuse, excuse_a_part};

/// A submission that must fail with `code`, say exactly one line that has all of `expected`, and leave no cube.
#[track_caller]
fn refused(place: &Place, output: &Output, code: i32, expected: &[&str]) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    assert!(stderr.starts_with("error: ") && stderr.lines().count() == 1, "{stderr}");
    for word in expected {
        assert!(stderr.contains(word), "{word}: {stderr}");
    }
    assert!(!exists(&place.at("cube.zarr")) && !exists(&place.at("cube.zarr.sbatch")), "{stderr}");
    assert_eq!(place.cluster.ask("squeue", &["--noheader", "--states=PENDING,RUNNING"]), "", "nothing is submitted");
}

/// Writes a program, and has this process's PATH find it before all others.
fn write_program(folder: &Path, name: &str, lines: &str) {
    let file = folder.join(name);
    fs::write(&file, format!("#!/bin/bash\n{lines}\n")).expect("written");
    fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).expect("set");
}

/// An `srun` that has the node run `lines`, with "$@" for what it was to run: a node that is set up in another way.
fn submit_where(place: &Place, lines: &str) -> Output {
    // Outside the shared folder, which some of these nodes do not see.
    let tools = tempfile::tempdir().expect("a folder");
    write_program(tools.path(), "on-node", lines);
    submit_on(place, &tools.path().join("on-node"))
}

/// An `srun` that has the node run `program` with what it was to run as arguments.
fn submit_on(place: &Place, program: &Path) -> Output {
    let tools = tempfile::tempdir().expect("a folder");
    let srun = "options=(); while [[ \"$1\" == -* ]]; do options+=(\"$1\"); shift; done\n\
                exec \"$SRUN\" \"${options[@]}\" \"$ON_NODE\" \"$@\"";
    write_program(tools.path(), "srun", srun);
    let path = std::env::var("PATH").expect("a path");
    let real = path.split(':').map(|folder| Path::new(folder).join("srun")).find(|file| file.is_file());
    let mut command = place.command(&[&["submit", "--spp", "1"], SUBMIT].concat());
    command.env("SRUN", real.expect("installed")).env("ON_NODE", program);
    command.env("PATH", format!("{}:{path}", tools.path().display()));
    command.output().expect("the binary runs")
}

/// Whether this user may make mounts that only one process sees.
fn can_mount() -> bool {
    let tried = Command::new("unshare").args(["--mount", "mount", "-t", "tmpfs", "none", "/mnt"]).output();
    let can = tried.is_ok_and(|output| output.status.success());
    if !can {
        excuse_a_part("mounts of one's own need root, and the permission of the container");
    }
    can
}

/// Cube, scene, program: what a node does not see or may not write is known before anything waits in the queue.
#[test]
fn a_node_that_does_not_see_what_it_needs() {
    let Some(place) = Place::new(1, 2) else { return };
    if can_mount() {
        let here = place.folder.path().display();
        let hidden = format!("exec unshare --mount bash -c 'mount -t tmpfs none {here} && exec \"$@\"' - \"$@\"");
        let output = submit_where(&place, &hidden);
        refused(&place, &output, 5, &["cube.zarr: a node of the cluster says: ", "cannot be seen from n1", "share"]);

        fs::create_dir(place.at("assets")).expect("made");
        fs::rename(place.at("scene.toml"), place.at("assets/scene.toml")).expect("moved");
        std::os::unix::fs::symlink("assets/scene.toml", place.at("scene.toml")).expect("linked");
        let no_assets =
            format!("exec unshare --mount bash -c 'mount -t tmpfs none {here}/assets && exec \"$@\"' - \"$@\"");
        let output = submit_where(&place, &no_assets);
        refused(&place, &output, 2, &["a node of the cluster says: ", "scene.toml", "cannot be read", "(on n1; scene"]);

        let read_only = format!(
            "exec unshare --mount bash -c 'mount --bind {here} {here} && mount -o remount,bind,ro {here} && exec \"$@\"' - \
             \"$@\""
        );
        let output = submit_where(&place, &read_only);
        refused(&place, &output, 5, &["cube.zarr", "cannot be written", "Read-only", "on n1"]);
    }
    let output = submit_on(&place, Path::new("/nowhere/spectile"));
    refused(&place, &output, 2, &["a node of the cluster says: the nodes cannot run ", "execve"]);
}

/// Locks that are refused, and locks that reach no other machine, both as the C library would tell.
#[test]
fn a_file_system_without_locks() {
    let Some(place) = Place::new(1, 2) else { return };
    let tools = tempfile::tempdir().expect("a folder");
    for (name, body, words) in [
        ("none", "errno = ENOLCK; return -1;", &["cannot lock files", "put the cube on another file system"][..]),
        ("local", "return 0;", &["do not reach from machine to machine"]),
    ] {
        let source = tools.path().join("locks.c");
        let code = format!(
            "#define _GNU_SOURCE\n#include <errno.h>\n#include <fcntl.h>\n#include <stdarg.h>\n#include <unistd.h>\n#include \
             <sys/syscall.h>\nstatic int call(int fd, int cmd, void *arg) {{ if (cmd == F_OFD_SETLK) {{ {body} }} return \
             syscall(SYS_fcntl, fd, cmd, arg); }}\nint fcntl(int fd, int cmd, ...) {{ va_list l; va_start(l, cmd); void *a = \
             va_arg(l, void *); va_end(l); return call(fd, cmd, a); }}\nint fcntl64(int fd, int cmd, ...) {{ va_list l; \
             va_start(l, cmd); void *a = va_arg(l, void *); va_end(l); return call(fd, cmd, a); }}\n"
        );
        fs::write(&source, code).expect("written");
        let library = tools.path().join(format!("{name}.so"));
        let made = Command::new("cc").args(["-shared", "-fPIC", "-o"]).arg(&library).arg(&source).status();
        assert!(made.expect("Rust needs a C compiler").success());
        let output = submit_where(&place, &format!("LD_PRELOAD={} exec \"$@\"", library.display()));
        refused(&place, &output, 5, &[&["cube.zarr"], words].concat());
    }
}

#[test]
fn what_the_cluster_does_not_have() {
    let Some(place) = Place::new(1, 2) else { return };
    let submit = |more: &[&str]| place.run(&[&["submit", "--spp", "1"], SUBMIT, more].concat());
    refused(&place, &submit(&["--partition", "none"]), 2, &["Slurm refuses the job", "partition"]);
    refused(&place, &submit(&["--sbatch", "--cpus-per-task=99"]), 2, &["Slurm refuses the job"]);
    refused(&place, &submit(&["--tasks", "1002"]), 2, &["--tasks 1002", "at most 1001 tasks", "MaxArraySize"]);
    refused(&place, &submit(&["--tasks", "65"]), 2, &["--tasks 65", "64 tiles"]);
    refused(&place, &submit(&["--set", "film.width=0"]), 2, &["film.width"]);
    let gpus = ["submit", "scene.toml", "-o", "cube.zarr", "--spp", "1"];
    refused(&place, &place.run(&gpus), 2, &["Slurm refuses the job"]);
}

/// Without Slurm there is a sentence; nothing else here needs it.
#[test]
fn no_cluster() {
    let (folder, _turn) = (folder_with_scene(), turn());
    let run = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
        command.current_dir(folder.path()).env("PATH", folder.path());
        command.args([&["submit", "--spp", "1"], SUBMIT, more].concat()).output().expect("the binary runs")
    };
    let output = run(&[]);
    let stderr = text(&output.stderr);
    assert_eq!((output.status.code(), stderr.lines().count()), (Some(2), 1), "{stderr}");
    assert!(stderr.contains("there is no `scontrol` on this machine") && stderr.contains("--dry-run"), "{stderr}");
    assert!(run(&["--dry-run"]).status.success());
    assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 1);
}

/// What changes between submission and start ends every task in seconds, is told by `info` and the summary, and is not tried
/// again.
#[test]
fn what_has_changed_before_the_tasks_begin() {
    let Some(place) = Place::new(2, 2) else { return };
    let case = |change: &dyn Fn(), expected: &[&str]| {
        let [array, finaliser] = place.submit(&["--spp", "1", "--tasks", "3", "--sbatch", "--hold"]);
        change();
        place.cluster.command("scontrol", &["release", &array.to_string(), &finaliser.to_string()]);
        place.cluster.wait_until_empty();
        let said =
            format!("{}{}", fs::read_to_string(place.at("cube.zarr.summary.txt")).unwrap_or_default(), place.logs());
        for word in expected {
            assert!(said.contains(word), "{word}: {said}");
        }
        fs::remove_dir_all(place.at("cube.zarr")).expect("removed");
        let _ = fs::remove_file(place.at("cube.zarr.summary.txt"));
    };
    let job = place.at("cube.zarr/.spectile/slurm/job.json");
    let other_version = || {
        let ours = fs::read_to_string(&job).expect("read");
        fs::write(&job, ours.replacen("\"version\": \"", "\"version\": \"9", 1)).expect("written");
    };
    case(&other_version, &["was submitted by Spectile 9", "put the same version on every node"]);
    let scene = place.at("scene.toml");
    let other_scene = || fs::write(&scene, super::SCENE.replace("0.5", "0.6")).expect("written");
    let not_complete = "NOT COMPLETE: 64 of 64 tiles are missing or damaged; no task could begin; n";
    case(&other_scene, &["this is not the scene that was submitted", not_complete]);
    fs::write(&scene, super::SCENE).expect("written");
    case(&|| fs::remove_file(&scene).expect("removed"), &["scene.toml: cannot be read", not_complete]);
    fs::write(&scene, super::SCENE).expect("written");
}

/// Slurm gives GPUs that Vulkan does not know: nothing else is used instead, such as a software device or another's GPU, unless that
/// is allowed.
#[test]
fn gpus_that_are_not_there() {
    let Some(place) = Place::with_gpus(1, 2, 2) else { return };
    let devices = Command::new(env!("CARGO_BIN_EXE_spectile")).args(["devices", "--json"]).output().expect("runs");
    if text(&devices.stdout).contains("\"is_software\":false") {
        excuse("this machine has GPUs");
        return;
    }
    let submit = ["submit", "scene.toml", "-o", "cube.zarr", "--tile", "8", "--spp", "1", "--tasks", "2"];
    let expected = ["n1: Slurm gave this job its GPU number ", "--gpus-per-task 0"];
    refused(&place, &place.run(&submit), 3, &expected);
    place.success(&[&submit[..], &["--allow-software"]].concat());
    place.cluster.wait_until_empty();
    assert_eq!(place.tiles_done(), 64, "{}", place.summary());
}
