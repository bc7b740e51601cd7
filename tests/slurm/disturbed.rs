//! Whatever happens to tasks, nodes and controller: the same bytes, and nothing is done by hand.

use std::fs;
use std::thread;
use std::time::Duration;

use super::cluster::signal;
use super::{Place, wait_for};

/// Samples that make the render last some ten seconds.
const SPP: &str = "4096";

/// An array at work, of which some tiles are done.
fn under_way(place: &Place, tasks: &str) -> [u64; 2] {
    let jobs = place.submit(&["--spp", SPP, "--tasks", tasks]);
    wait_for("the first tiles", || {
        let work = place.work();
        let some = |key: &str| work[key].as_array().is_some_and(|list| !list.is_empty());
        (some("running") && work["runs"].as_array().is_some_and(|runs| runs.len() >= 2)).then_some(())
    });
    jobs
}

/// Processes of the array's tasks.
fn tasks(place: &Place) -> Vec<u32> {
    let is_task = |process: &u32| {
        fs::read(format!("/proc/{process}/cmdline")).is_ok_and(|line| line.windows(10).any(|w| w == b"array-task"))
    };
    place.cluster.processes(None).into_iter().map(|(process, _)| process).filter(is_task).collect()
}

#[test]
#[ignore = "a minute on a real cluster"]
fn a_killed_task_is_submitted_again() {
    let Some(place) = Place::new(2, 2) else { return };
    under_way(&place, "8");
    // Two at once, so that one of them is in the middle of something.
    tasks(&place).into_iter().take(2).for_each(|process| signal(process, "KILL"));
    wait_for("the loss to be seen", || {
        let work = place.work();
        work["failed"].as_array().is_some_and(|failed| !failed.is_empty()).then_some(())
    });
    place.ends_with_the_same_bytes(SPP);
    let summary = place.summary();
    assert_eq!(summary.lines().filter(|line| line.starts_with("array job")).count(), 2, "{summary}");
    assert!(summary.contains(" lost\n"), "{summary}");
}

#[test]
#[ignore = "a minute on a real cluster"]
fn a_killed_node_loses_nothing() {
    let Some(mut place) = Place::new(3, 2) else { return };
    under_way(&place, "8");
    place.cluster.node_down(1);
    place.ends_with_the_same_bytes(SPP);
    place.cluster.node_up(1);
}

#[test]
#[ignore = "a minute on a real cluster"]
fn a_requeued_array_goes_on() {
    let Some(place) = Place::new(2, 2) else { return };
    let [array, _] = under_way(&place, "6");
    // Pending tasks answer that they are pending, which is no error of those that run.
    place.cluster.command("scontrol", &["requeue", &array.to_string()]);
    place.ends_with_the_same_bytes(SPP);
    let runs = place.runs();
    assert!(runs.iter().any(|(_, restarts)| *restarts > 0), "{runs:?}");
}

#[test]
#[ignore = "a minute on a real cluster"]
fn a_restarted_controller_changes_nothing() {
    let Some(mut place) = Place::new(2, 2) else { return };
    under_way(&place, "8");
    place.cluster.stop_controller();
    place.cluster.start_controller(false);
    place.ends_with_the_same_bytes(SPP);
}

#[test]
#[ignore = "a minute on a real cluster"]
fn a_killed_controller_changes_nothing() {
    let Some(mut place) = Place::new(2, 2) else { return };
    under_way(&place, "8");
    place.cluster.kill_controller();
    thread::sleep(Duration::from_secs(4));
    place.cluster.start_controller(false);
    place.ends_with_the_same_bytes(SPP);
}

/// One task, a minute, and work for more than that: SIGTERM comes, the task commits, requeues itself and goes on.
#[test]
#[ignore = "some minutes on a real cluster: time limits are whole minutes"]
fn a_time_limit_shorter_than_a_task_is_no_obstacle() {
    const LONG: &str = "16384";
    let Some(place) = Place::new(1, 1) else { return };
    place.submit(&["--spp", LONG, "--tasks", "1", "--time-limit", "1m"]);
    place.ends_with_the_same_bytes(LONG);
    let runs = place.runs();
    assert!(runs.iter().any(|(state, _)| state == "interrupted"), "{runs:?}");
    let summary = place.summary();
    assert_eq!(summary.lines().filter(|line| line.starts_with("array job")).count(), 1, "{summary}");
}

/// A cancelled task does not come back by itself; its tiles are waited for by nobody, and gone on with when asked.
#[test]
#[ignore = "a minute on a real cluster"]
fn a_cancelled_array_stays_away_until_it_is_resumed() {
    let Some(place) = Place::new(2, 2) else { return };
    let [array, finaliser] = under_way(&place, "8");
    let refused = place.run(&[&["submit", "--resume", "--spp", SPP], super::SUBMIT].concat());
    let said = super::text(&refused.stderr);
    assert!(refused.status.code() == Some(2) || refused.status.code() == Some(5), "{said}");
    place.cluster.command("scancel", &[&array.to_string(), &finaliser.to_string()]);
    place.cluster.wait_until_empty();
    let before = place.tiles_done();
    assert!(before < 64);
    assert!(place.runs().iter().any(|(state, _)| state == "interrupted"), "{:?}", place.runs());
    place.submit(&["--resume", "--spp", SPP]);
    place.ends_with_the_same_bytes(SPP);
}

/// Two workers on the same tiles, of which neither knows of the other's lock: who finds the journal changed stops, and what is
/// missing is submitted again.
#[test]
#[ignore = "a minute on a real cluster"]
fn two_workers_on_a_tile_end_with_the_same_bytes() {
    let Some(place) = Place::new(2, 2) else { return };
    under_way(&place, "2");
    // From now on a newcomer locks another file than those at work.
    fs::remove_file(place.at("cube.zarr/.spectile/lock")).expect("removed");
    let other = ["render", "scene.toml", "-o", "cube.zarr", "--tile", "8", "--tiles", "0..32", "--quiet", "--spp", SPP];
    let output = place.run(&other);
    let code = output.status.code();
    assert!(code == Some(0) || code == Some(5), "{code:?} {}", super::text(&output.stderr));
    place.ends_with_the_same_bytes(SPP);
}
