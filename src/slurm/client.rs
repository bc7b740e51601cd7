//! Slurm's own programs: asked and told things, and what they say against it.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use crate::{Error, Result};

/// What a Slurm program did.
struct Said {
    success: bool,
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

fn run(command: &mut Command) -> Result<Said> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output();
    output.map(said).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => Error::Usage(format!(
            "there is no `{program}` on this machine; submit from one that belongs to a Slurm cluster (--dry-run shows what \
             would be submitted)"
        )),
        _ => Error::Usage(format!("`{program}` cannot be run: {error}")),
    })
}

fn said(output: Output) -> Said {
    Said {
        success: output.status.success(),
        code: output.status.code(),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// What a Slurm program says for itself, on a line.
fn complaint(stderr: &str) -> String {
    let each = stderr.lines().map(str::trim).filter(|line| !line.is_empty());
    let text = each.collect::<Vec<_>>().join("; ");
    if text.is_empty() { "it says nothing".into() } else { text }
}

/// Indices that an array may have on this cluster: MaxArraySize.
pub fn array_limit() -> Result<u32> {
    let said = run(Command::new("scontrol").args(["show", "config"]))?;
    let value = |line: &str| line.strip_prefix("MaxArraySize")?.trim_start().strip_prefix('=')?.trim().parse().ok();
    match said.stdout.lines().find_map(value) {
        Some(limit) if said.success => Ok(limit),
        _ => Err(Error::Usage(format!("the Slurm cluster does not answer: {}", complaint(&said.stderr)))),
    }
}

/// Whether sbatch would take a script, without submitting it.
pub fn test(script: &Path) -> Result<()> {
    let said = run(Command::new("sbatch").arg("--test-only").arg(script))?;
    if said.success { Ok(()) } else { Err(refused(&said)) }
}

/// Submits a job, and returns its number.
pub fn submit(arguments: &[String]) -> Result<u64> {
    let said = run(Command::new("sbatch").arg("--parsable").args(arguments))?;
    // `JOB` or `JOB;CLUSTER`.
    let number = said.stdout.trim().split(';').next().and_then(|text| text.parse().ok());
    match number {
        Some(number) if said.success => Ok(number),
        _ => Err(refused(&said)),
    }
}

fn refused(said: &Said) -> Error {
    Error::Usage(format!("Slurm refuses the job: {}", complaint(&said.stderr)))
}

/// Ends jobs, as far as they are still there.
pub fn cancel(jobs: &[u64]) {
    // Whoever calls this reports an error already.
    let _ = run(Command::new("scancel").args(jobs.iter().map(u64::to_string)));
}

/// States of the tasks of a job that are waiting or running, and how many have each; empty where there are none any more, `None`
/// where the cluster cannot be asked.
pub fn states(jobs: &[u64]) -> Option<Vec<(String, usize)>> {
    let list = jobs.iter().map(u64::to_string).collect::<Vec<_>>().join(",");
    let said = run(Command::new("squeue").args(["--noheader", "--array", "--format=%T", "--jobs", &list])).ok()?;
    if !said.success {
        // What it has forgotten has ended.
        return said.stderr.contains("Invalid job id").then(Vec::new);
    }
    let mut found: Vec<(String, usize)> = Vec::new();
    for state in said.stdout.lines().map(|line| line.trim().to_lowercase()) {
        match found.iter_mut().find(|(name, _)| *name == state) {
            Some((_, count)) => *count += 1,
            None => found.push((state, 1)),
        }
    }
    Some(found)
}

/// Puts this running task, `ARRAY_TASK`, back into the queue: the number alone of one of the tasks is that of the whole array. False where it is not running by Slurm's account: it was cancelled, or Slurm
/// requeues it by itself. Slurm's controller may be away for a moment.
pub fn requeue(task: &str) -> Result<bool> {
    const ATTEMPTS: u32 = 10;
    const PAUSE: Duration = Duration::from_secs(3);
    let mut last = String::new();
    for attempt in 0..ATTEMPTS {
        if attempt > 0 {
            thread::sleep(PAUSE);
        }
        let state = run(Command::new("squeue").args(["--noheader", "--format=%T", "--jobs", task]))?;
        if !state.success {
            last = complaint(&state.stderr);
            continue;
        }
        if state.stdout.trim() != "RUNNING" {
            return Ok(false);
        }
        let said = run(Command::new("scontrol").args(["requeue", task]))?;
        if said.success {
            return Ok(true);
        }
        last = complaint(&said.stderr);
    }
    Err(Error::Usage(format!("job {task} cannot be requeued: {last}")))
}

/// What running a command on one node, at once, told.
#[derive(Debug)]
pub enum Tried {
    /// Its stdout.
    Fine(String),
    /// It ran, and ended with this code and these words.
    Wrong(i32, String),
    /// No node was free at once, or Slurm would not have it: nothing is known.
    NotRun(String),
}

/// Runs a command on one node, if one is free within `wait_s` seconds. The command's words come through Slurm, not through a
/// shared file system.
pub fn try_on_a_node(
    options: &[String],
    wait_s: u32,
    program: &Path,
    arguments: &[&str],
    cube: &Path,
) -> Result<Tried> {
    let mut command = Command::new("srun");
    command.args([&format!("--immediate={wait_s}"), "--ntasks=1", "--job-name=spectile-probe", "--time=5", "--quiet"]);
    // The folder one is in need not be there.
    command.args(["--chdir=/"]).args(options).arg(program).args(arguments).arg(cube);
    let said = run(&mut command)?;
    let errors: Vec<&str> = said.stderr.lines().filter_map(|line| line.strip_prefix("error: ")).collect();
    Ok(match said.code {
        Some(0) => Tried::Fine(said.stdout),
        Some(code) if !errors.is_empty() => Tried::Wrong(code, errors.join("; ")),
        Some(code) if said.stderr.contains("execve") => {
            Tried::Wrong(code, format!("the nodes cannot run {}: {}", program.display(), complaint(&said.stderr)))
        }
        _ => Tried::NotRun(complaint(&said.stderr)),
    })
}
