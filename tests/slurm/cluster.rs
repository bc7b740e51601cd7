//! A real Slurm cluster on this machine: munged, slurmctld and several slurmd, each of which is a node, in a folder that goes
//! with it. No systemd, cgroups or database; runs as any user.

use std::fs;
use std::io::Read;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use tempfile::TempDir;

use crate::report::excuse;

/// Programs of Debian's packages slurmctld, slurmd, slurm-client and munge.
const PROGRAMS: [&str; 9] =
    ["munged", "munge", "slurmctld", "slurmd", "sbatch", "srun", "scontrol", "squeue", "scancel"];

/// Long enough for anything here on a busy machine; what takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(240);
/// The same for all that is in the queue: renders, one after the other.
const JOBS_PATIENCE: Duration = Duration::from_secs(1800);

pub struct Cluster {
    folder: TempDir,
    nodes: Vec<Node>,
    controller: Option<Child>,
    munge: Child,
}

struct Node {
    name: String,
    daemon: Option<Child>,
}

/// Where a program is: Debian has the daemons in folders of root's.
fn find(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin", "/sbin"].map(PathBuf::from));
    folders.map(|folder| folder.join(program)).find(|file| file.is_file())
}

/// Whether Slurm is installed here; says so where it is not. `./check --full` sets SPECTILE_SLURM=required.
pub fn is_there() -> bool {
    let missing: Vec<&str> = PROGRAMS.into_iter().filter(|program| find(program).is_none()).collect();
    if missing.is_empty() {
        return true;
    }
    let required = std::env::var("SPECTILE_SLURM").is_ok_and(|value| value == "required");
    assert!(!required, "Slurm must be there for these tests, and lacks {missing:?}");
    excuse(&format!("no Slurm here (./check --full installs it): {missing:?}"));
    false
}

fn start(program: &str, arguments: &[&str], log: &Path) -> Child {
    let output = fs::File::options().create(true).append(true).open(log).expect("a log");
    let mut command = Command::new(find(program).expect("installed"));
    command.args(arguments).stdin(Stdio::null()).stdout(output.try_clone().expect("a file")).stderr(output);
    // A signal to this process's group, such as Ctrl-C, is for this process, which ends them in order.
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn().expect("started")
}

/// Asks again and again until there is an answer.
pub fn wait_for<T>(what: &str, ask: impl FnMut() -> Option<T>) -> T {
    wait_long_for(what, PATIENCE, ask)
}

fn wait_long_for<T>(what: &str, time_limit: Duration, mut ask: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(began.elapsed() < time_limit, "waited too long for {what}");
        thread::sleep(Duration::from_millis(50));
    }
}

impl Cluster {
    /// `nodes` nodes of `cpus` CPUs each, named n1, n2, …; with `gpus` > 0 each claims to have so many.
    pub fn start(nodes: usize, cpus: u32, gpus: u32) -> Cluster {
        let folder = tempfile::Builder::new().prefix("slurm").tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let text = |path: PathBuf| path.to_str().expect("UTF-8").to_owned();
        for name in ["state", "log"] {
            fs::create_dir(at(name)).expect("made");
        }
        let (key, socket) = (at("munge.key"), text(at("munge.socket")));
        let mut secret = [0; 128];
        fs::File::open("/dev/urandom").and_then(|mut file| file.read_exact(&mut secret)).expect("random bytes");
        fs::write(&key, secret).expect("written");
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(&key, fs::Permissions::from_mode(0o400)).expect("set");
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).expect("set");
        let munge = start(
            "munged",
            &[
                "--foreground",
                "--force",
                "--num-threads=2",
                &format!("--key-file={}", text(key)),
                &format!("--socket={socket}"),
                &format!("--pid-file={}", text(at("munge.pid"))),
                &format!("--log-file={}", text(at("log/munge.log"))),
                &format!("--seed-file={}", text(at("munge.seed"))),
            ],
            &at("log/munge.out"),
        );
        let mut cluster = Cluster { folder, nodes: Vec::new(), controller: None, munge };
        cluster.configure(&socket, nodes, cpus, gpus);
        wait_for("munge", || Path::new(&socket).exists().then_some(()));
        cluster.start_controller(true);
        for i in 1..=nodes {
            cluster.nodes.push(Node { name: format!("n{i}"), daemon: None });
            cluster.node_up(i - 1);
        }
        cluster
    }

    fn configure(&self, socket: &str, nodes: usize, cpus: u32, gpus: u32) {
        let at = |name: &str| self.folder.path().join(name).to_str().expect("UTF-8").to_owned();
        // Held until all are known, so that they differ.
        let listeners: Vec<_> = (0..=nodes).map(|_| TcpListener::bind("127.0.0.1:0").expect("a port")).collect();
        let ports: Vec<u16> = listeners.iter().map(|l| l.local_addr().expect("an address").port()).collect();
        let told = |program: &str, arguments: &[&str]| {
            let output = Command::new(program).args(arguments).output().expect("a program of every system");
            String::from_utf8(output.stdout).expect("UTF-8").trim().to_owned()
        };
        let (host, user) = (told("uname", &["-n"]), told("id", &["-un"]));
        let host = host.split('.').next().expect("a name");
        let (state, log, spool) = (at("state"), at("log"), at("spool"));
        let mut text = format!(
            "ClusterName=test\n\
             SlurmctldHost={host}(127.0.0.1)\n\
             SlurmUser={user}\nSlurmdUser={user}\n\
             AuthType=auth/munge\nCredType=cred/munge\n\
             # A requeued task runs again after the lifetime of its credential; 5 seconds is the least.\n\
             AuthInfo=socket={socket},cred_expire=5\n\
             SlurmctldPort={}\n\
             StateSaveLocation={state}\nSlurmdSpoolDir={spool}-%n\n\
             SlurmctldPidFile={state}/ctld.pid\nSlurmdPidFile={state}/%n.pid\n\
             SlurmctldLogFile={log}/ctld.log\nSlurmdLogFile={log}/%n.log\n\
             ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\n\
             AccountingStorageType=accounting_storage/none\nMpiDefault=none\nSwitchType=switch/none\n\
             SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\n\
             SchedulerType=sched/backfill\nSchedulerParameters=sched_interval=2,batch_sched_delay=0,bf_interval=2\n\
             PropagateResourceLimits=NONE\nReturnToService=2\nJobRequeue=1\nSlurmdParameters=config_overrides\n\
             SlurmctldTimeout=10\nSlurmdTimeout=10\nInactiveLimit=0\nMinJobAge=3600\nKillWait=5\n\
             MaxArraySize=1001\n",
            ports[0]
        );
        let mut gres = String::new();
        if gpus > 0 {
            text += "GresTypes=gpu\n";
            gres = format!(" Gres=gpu:{gpus}");
            let files: Vec<String> = (0..gpus).map(|i| at(&format!("device{i}"))).collect();
            // Slurm takes nothing but devices.
            files.iter().for_each(|file| std::os::unix::fs::symlink("/dev/null", file).expect("linked"));
            let files = format!("{}[0-{}]", at("device"), gpus - 1);
            fs::write(at("gres.conf"), format!("Name=gpu File={files}\n")).expect("written");
        }
        for (i, port) in (1..=nodes).zip(&ports[1..]) {
            text += &format!(
                "NodeName=n{i} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={cpus} RealMemory=1000{gres}\n"
            );
        }
        text += &format!("PartitionName=tiles Nodes=n[1-{nodes}] Default=YES MaxTime=INFINITE State=UP\n");
        fs::write(self.conf(), text).expect("written");
    }

    pub fn conf(&self) -> PathBuf {
        self.folder.path().join("slurm.conf")
    }

    /// Starts slurmctld; from nothing, or where it stood.
    pub fn start_controller(&mut self, is_new: bool) {
        let conf = self.conf();
        let mut arguments = vec!["-D", "-f", conf.to_str().expect("UTF-8")];
        arguments.extend(is_new.then_some("-c"));
        self.controller = Some(start("slurmctld", &arguments, &self.folder.path().join("log/ctld.out")));
        wait_for("slurmctld", || self.command("scontrol", &["ping"]).status.success().then_some(()));
    }

    /// SIGTERM, as when its service is restarted: it saves what it knows.
    pub fn stop_controller(&mut self) {
        let mut controller = self.controller.take().expect("running");
        signal(controller.id(), "TERM");
        controller.wait().expect("ended");
    }

    /// SIGKILL, as when its machine fails. It saves what it knows five seconds after a change; what is not saved yet would be lost
    /// to Slurm itself, so this waits until all of now is.
    pub fn kill_controller(&mut self) {
        let (now, state) = (SystemTime::now(), self.folder.path().join("state/job_state"));
        wait_for("the controller to save", || {
            fs::metadata(&state).and_then(|file| file.modified()).is_ok_and(|saved| saved > now).then_some(())
        });
        let mut controller = self.controller.take().expect("running");
        controller.kill().expect("killed");
        controller.wait().expect("ended");
    }

    /// Starts a node, and waits until it takes jobs.
    pub fn node_up(&mut self, node: usize) {
        let (conf, log) = (self.conf(), self.folder.path().join(format!("log/n{}.out", node + 1)));
        let step = find("slurmstepd");
        let mut arguments = vec!["-D", "-N", &self.nodes[node].name, "-f", conf.to_str().expect("UTF-8")];
        arguments.extend(step.as_ref().and_then(|step| step.to_str()).into_iter().flat_map(|step| ["-d", step]));
        self.nodes[node].daemon = Some(start("slurmd", &arguments, &log));
        let name = self.nodes[node].name.clone();
        wait_for("a node", || {
            let said = self.command("sinfo", &["-h", "-n", &name, "-o", "%t"]);
            let state = String::from_utf8(said.stdout).expect("UTF-8");
            ["idle", "mix", "alloc"].contains(&state.trim()).then_some(())
        });
    }

    /// SIGKILL to a node's daemon and everything that it runs: what a power cut does.
    pub fn node_down(&mut self, node: usize) {
        let mut daemon = self.nodes[node].daemon.take().expect("running");
        // It starts nothing more while its jobs are ended.
        signal(daemon.id(), "STOP");
        let jobs = self.processes(Some(&self.nodes[node].name));
        for (process, parent) in &jobs {
            if fs::read_to_string(format!("/proc/{parent}/comm")).is_ok_and(|name| name.trim() == "slurmstepd") {
                signal(*parent, "KILL");
            }
            signal(*process, "KILL");
        }
        daemon.kill().expect("killed");
        daemon.wait().expect("ended");
    }

    /// Processes of this cluster's jobs, on one node or on all: their numbers and those of their parents.
    pub fn processes(&self, node: Option<&str>) -> Vec<(u32, u32)> {
        let conf = format!("SLURM_CONF={}", self.conf().display());
        let node = node.map(|node| format!("SLURMD_NODENAME={node}"));
        let mut found = Vec::new();
        for entry in fs::read_dir("/proc").expect("/proc").flatten() {
            let Some(process) = entry.file_name().to_str().and_then(|name| name.parse::<u32>().ok()) else { continue };
            let environment = fs::read(entry.path().join("environ")).unwrap_or_default();
            let has = |wanted: &str| environment.split(|&b| b == 0).any(|word| word == wanted.as_bytes());
            if has(&conf) && has_job(&environment) && node.as_ref().is_none_or(|node| has(node)) {
                let status = fs::read_to_string(entry.path().join("status")).unwrap_or_default();
                let parent = status.lines().find_map(|line| line.strip_prefix("PPid:")?.trim().parse().ok());
                found.extend(parent.map(|parent| (process, parent)));
            }
        }
        found
    }

    /// A command with this cluster's configuration.
    pub fn prepare(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.conf());
        command
    }

    pub fn command(&self, program: &str, arguments: &[&str]) -> Output {
        self.prepare(program).args(arguments).output().expect("installed")
    }

    /// Stdout of one of Slurm's programs.
    pub fn ask(&self, program: &str, arguments: &[&str]) -> String {
        String::from_utf8(self.command(program, arguments).stdout).expect("UTF-8").trim().to_owned()
    }

    /// Waits until nothing is in the queue any more.
    pub fn wait_until_empty(&self) {
        wait_long_for("the end of all jobs", JOBS_PATIENCE, || {
            let said = self.command("squeue", &["--noheader"]);
            (said.status.success() && said.stdout.is_empty()).then_some(())
        });
    }
}

fn has_job(environment: &[u8]) -> bool {
    environment.split(|&b| b == 0).any(|word| word.starts_with(b"SLURM_JOB_ID="))
}

pub fn signal(process: u32, name: &str) {
    // It may have ended already.
    let _ = Command::new("kill").args(["-s", name, &process.to_string()]).stderr(Stdio::null()).status();
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let jobs = self.ask("squeue", &["--noheader", "--format=%A"]);
        if !jobs.is_empty() {
            self.command("scancel", &jobs.split_whitespace().collect::<Vec<_>>());
        }
        // Jobs end before the daemons that would end them.
        let began = Instant::now();
        while !self.processes(None).is_empty() && began.elapsed() < Duration::from_secs(10) {
            thread::sleep(Duration::from_millis(50));
        }
        let daemons = self.nodes.iter_mut().filter_map(|node| node.daemon.take());
        let mut all: Vec<Child> = daemons.chain(self.controller.take()).collect();
        all.iter().for_each(|daemon| signal(daemon.id(), "TERM"));
        let began = Instant::now();
        while all.iter_mut().any(|daemon| matches!(daemon.try_wait(), Ok(None))) {
            if began.elapsed() > Duration::from_secs(10) {
                all.iter_mut().for_each(|daemon| drop(daemon.kill()));
            }
            thread::sleep(Duration::from_millis(20));
        }
        drop(self.munge.kill());
        drop(self.munge.wait());
    }
}
