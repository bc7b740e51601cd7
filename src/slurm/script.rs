//! The batch script beside a cube, and the commands that submit it.

use std::path::Path;

use super::{Job, folder, quote, script_path};
use crate::{Error, Result};

/// Seconds between SIGTERM and the time limit, and the share of a short limit that they may be.
const END_S: u64 = 60;
const END_SHARE: u64 = 4;

/// Tells the script from others.
pub const WRITTEN_BY: &str = "# Written by `spectile submit`";

/// The script of the array, for people to read and for sbatch to run. `tasks` are in sbatch's words.
pub fn text(job: &Job, cube: &Path, tasks: &str) -> Result<String> {
    let request = &job.request;
    let log = folder(cube).display().to_string();
    if log.contains(['\n', '"', '\\']) {
        let what = "has a line break, a quotation mark or a backslash in its path, which sbatch does not take";
        return Err(Error::Usage(format!("{} {what}", cube.display())));
    }
    let per_task = match (job.tiles / job.tasks, job.tiles.div_ceil(job.tasks)) {
        (1, 1) => "1 tile".into(),
        (least, most) if least == most => format!("{most} tiles"),
        (least, most) => format!("{least} or {most} tiles"),
    };
    let mut text = format!(
        "#!/bin/bash\n\
         # {} tasks of {per_task} each make {} from {}.\n\
         {WRITTEN_BY}, {}. On one machine the same bytes come from\n\
         #   {}\n\
         #\n",
        job.tasks,
        cube.display(),
        job.scene.display(),
        job.version,
        job.render_command(cube),
    );
    let mut option = |option: &str| text += &format!("#SBATCH {option}\n");
    option(&format!("--job-name={}", quote_option(&request.name)));
    option(&format!("--array={tasks}"));
    option("--ntasks=1");
    if request.gpus_per_task > 0 {
        option(&format!("--gpus-per-task={}", request.gpus_per_task));
    }
    for common in common_options(job) {
        option(&quote_option(&common));
    }
    // Reaches the program itself, since it takes the place of the shell.
    option(&format!("--signal=B:TERM@{}", end_s(job)));
    option("--requeue");
    option("--open-mode=append");
    option(&format!("--output={}", quote_option(&format!("{}/%A_%a.log", log.replace('%', "%%")))));
    text += &format!(
        "\n\
         # Software devices get as many threads as the task has CPUs; GPUs are those that Slurm gives the task.\n\
         export LP_NUM_THREADS=\"${{SLURM_CPUS_ON_NODE:-1}}\"\n\
         # On SIGTERM, before the time limit or at preemption, it commits what is merged and requeues its task.\n\
         exec {} array-task {}\n",
        quote(&job.program.display().to_string()),
        quote(&cube.display().to_string())
    );
    Ok(text)
}

/// Options that array and finaliser share.
fn common_options(job: &Job) -> Vec<String> {
    let request = &job.request;
    let partition = request.partition.iter().map(|partition| format!("--partition={partition}"));
    let time = request.time_limit.iter().map(|minutes| format!("--time={:02}:{:02}:00", minutes / 60, minutes % 60));
    partition.chain(time).chain(request.more.iter().cloned()).collect()
}

/// Options of the probe that srun runs before anything is submitted.
pub fn probe_options(job: &Job) -> Vec<String> {
    let request = &job.request;
    let gpus = (request.gpus_per_task > 0).then(|| format!("--gpus-per-task={}", request.gpus_per_task));
    let partition = request.partition.iter().map(|partition| format!("--partition={partition}"));
    gpus.into_iter().chain(partition).chain(request.more.iter().cloned()).collect()
}

fn end_s(job: &Job) -> u64 {
    job.request.time_limit.map_or(END_S, |minutes| END_S.min(60 * minutes / END_SHARE))
}

/// Arguments with which sbatch submits the array: only `tasks` of it, and not on the nodes `except`.
pub fn array_arguments(cube: &Path, tasks: &str, except: &[String]) -> Vec<String> {
    let mut arguments = vec![format!("--array={tasks}")];
    if !except.is_empty() {
        arguments.push(format!("--exclude={}", except.join(",")));
    }
    arguments.push(script_path(cube).display().to_string());
    arguments
}

/// Arguments with which sbatch submits the finaliser of the array job `array`.
pub fn finaliser_arguments(job: &Job, cube: &Path, array: &str) -> Vec<String> {
    let log = folder(cube).display().to_string().replace('%', "%%");
    let mut arguments = vec![
        // A task that failed does not keep it from coming.
        format!("--dependency=afterany:{array}"),
        format!("--job-name={}-end", job.request.name),
        "--ntasks=1".into(),
    ];
    arguments.extend(common_options(job));
    arguments.extend(["--requeue".into(), "--open-mode=append".into(), format!("--output={log}/end-%j.log")]);
    arguments.push("--wrap".into());
    let [program, cube] = [&job.program, cube].map(|path| quote(&path.display().to_string()));
    arguments.push(format!("exec {program} array-end {cube}"));
    arguments
}

/// A command line for people.
pub fn command(program: &str, arguments: &[String]) -> String {
    [program.to_owned()]
        .into_iter()
        .chain(arguments.iter().map(|argument| quote(argument)))
        .collect::<Vec<_>>()
        .join(" ")
}

/// An option as a line of the script takes it.
fn quote_option(option: &str) -> String {
    if !option.contains([' ', '\'', '#', '(', ')', ';', '&', '|']) {
        return option.to_owned();
    }
    // The name outside, so that it is seen.
    match option.split_once('=') {
        Some((name, value)) if name.starts_with("--") => format!("{name}=\"{value}\""),
        _ => format!("\"{option}\""),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::job;
    use super::*;

    #[test]
    fn odd_paths_reach_sbatch() {
        let mut job = job(9, 9);
        job.request.time_limit = Some(1);
        job.request.more.push("--comment=two words".into());
        let text = text(&job, Path::new("/data/50 % done/it's.zarr"), "0-8").expect("fine");
        for line in [
            "# 9 tasks of 1 tile each make /data/50 % done/it's.zarr from /home/ada/box.toml.",
            "#SBATCH --time=00:01:00",
            "#SBATCH --comment=\"two words\"",
            "#SBATCH --signal=B:TERM@15",
            "#SBATCH --output=\"/data/50 %% done/it's.zarr/.spectile/slurm/%A_%a.log\"",
            "exec /opt/spectile/bin/spectile array-task '/data/50 % done/it'\\''s.zarr'",
        ] {
            assert!(text.lines().any(|l| l == line), "{line}\n{text}");
        }
        assert!(super::text(&job, Path::new("/data/a\nb.zarr"), "0-8").is_err());
    }
}
