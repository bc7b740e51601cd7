//! Adapters and devices: which there are, what they can do, and one opened for work.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::time::Duration;

use serde::Serialize;

use super::kept::{self, Identity, Kept};
use crate::gpu::allocation::{self, Given};
use crate::gpu::deadline::Deadline;
use crate::gpu::instance::instance;
use crate::{Error, Result};

/// What `spectile devices` says of one adapter.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct AdapterFacts {
    pub name: String,
    pub backend: String,
    /// `discrete GPU`, `integrated GPU`, `virtual GPU`, `CPU (software)` or `other`.
    pub kind: String,
    pub driver: String,
    /// Address on the PCI bus, where the driver tells it.
    pub pci: Option<String>,
    /// Largest buffer that one binding can show, bytes.
    pub max_binding: u64,
    pub max_buffer: u64,
    /// Storage buffers that one kernel can bind; how many a scene needs, `spectile plan` says.
    pub storage_buffers: u32,
    pub timestamps: bool,
    pub is_software: bool,
    /// Why Spectile cannot use it.
    pub unusable: Option<String>,
}

/// An opened device, with its own wgpu Instance (devices of one Instance serialise on software drivers).
pub struct Gpu {
    pub name: String,
    pub is_software: bool,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub limits: wgpu::Limits,
    pub timestamps: bool,
    /// Checks that the shader translator adds; all off but in tests.
    pub shader_checks: wgpu::ShaderRuntimeChecks,
    /// Until when the thread that works with it must be back from its driver.
    pub deadline: Arc<Deadline>,
    #[cfg(test)]
    pub faults: Arc<crate::gpu::fault::Faults>,
    trouble: Arc<Mutex<Option<Trouble>>>,
    instance: wgpu::Instance,
    identity: Identity,
}

impl Drop for Gpu {
    fn drop(&mut self) {
        kept::give(Kept {
            identity: self.identity.clone(),
            device: self.device.clone(),
            queue: self.queue.clone(),
            trouble: Arc::clone(&self.trouble),
            instance: self.instance.clone(),
        });
    }
}

/// What went wrong on a device: the first thing, unless it is lost.
#[derive(Debug)]
pub(crate) enum Trouble {
    Memory,
    /// It did not answer.
    Hung(Duration),
    Lost(String),
    Other(String),
}

fn adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

/// GPUs first, software last.
fn rank(info: &wgpu::AdapterInfo) -> u32 {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn facts(adapter: &wgpu::Adapter) -> AdapterFacts {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    let unusable = (limits.max_compute_invocations_per_workgroup < 256)
        .then(|| "its compute workgroups are smaller than 256".to_owned());
    AdapterFacts {
        name: info.name,
        backend: info.backend.to_string(),
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "CPU (software)",
            wgpu::DeviceType::Other => "other",
        }
        .to_owned(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        pci: Some(info.device_pci_bus_id).filter(|address| !address.is_empty()),
        max_binding: limits.max_storage_buffer_binding_size,
        max_buffer: limits.max_buffer_size,
        storage_buffers: limits.max_storage_buffers_per_shader_stage,
        timestamps: adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        is_software: info.device_type == wgpu::DeviceType::Cpu,
        unusable,
    }
}

/// Every adapter of this machine, GPUs first.
pub fn list() -> Vec<AdapterFacts> {
    // Kept, and with it the drivers in this process: NVIDIA's lists no adapter any more after it has been loaded and unloaded some
    // twenty times.
    static KEPT: OnceLock<wgpu::Instance> = OnceLock::new();
    sorted_adapters(KEPT.get_or_init(instance)).iter().map(facts).collect()
}

/// GPUs first, each through as many backends as list it.
fn sorted_adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut adapters = adapters(instance);
    adapters.sort_by_key(|a| rank(&a.get_info()));
    adapters
}

/// Which devices to render on.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Selection {
    /// Every GPU, each once; software devices only where there is no GPU.
    #[default]
    All,
    /// So many of those; more than there are share them.
    Count(usize),
    /// Positions in [`list`].
    List(Vec<usize>),
    /// Every software device, whatever else there is.
    Software,
}

impl std::str::FromStr for Selection {
    type Err = String;

    /// `all`, a count, or a list of positions such as `0,2` (a single one: `0,`).
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let number = |text: &str| text.trim().parse::<usize>().ok();
        let list = || text.split(',').filter(|part| !part.trim().is_empty()).map(number).collect::<Option<Vec<_>>>();
        let parsed = match text {
            "all" => Some(Selection::All),
            text if text.contains(',') => list().filter(|list| !list.is_empty()).map(Selection::List),
            text => number(text).filter(|&n| (1..=MAX_DEVICES).contains(&n)).map(Selection::Count),
        };
        parsed.ok_or_else(|| {
            format!("devices are `all`, a number from 1 to {MAX_DEVICES}, or positions as `spectile devices` lists them, such as 0,2")
        })
    }
}

/// More devices than this on one machine are a typing error.
const MAX_DEVICES: usize = 64;

impl Selection {
    /// Positions in `listed`, of GPUs only those `given`. Errors: no usable adapter, or a position that is not there, not
    /// usable or not given.
    fn choose(&self, listed: &[AdapterFacts], given: &Given) -> Result<Vec<usize>> {
        // Where Slurm does not say which GPUs it gave, whoever names them knows.
        let given = match (self, given) {
            (Selection::List(_), Given::Count(_)) => &Given::Everything,
            (_, given) => given,
        };
        let all = match self {
            Selection::Software => software_among(listed),
            _ => usable_once(listed, given)?,
        };
        match self {
            Selection::List(positions) => {
                for &position in positions {
                    let unusable = match listed.get(position) {
                        None => Some("there is no such adapter".to_owned()),
                        Some(facts) if facts.unusable.is_some() => facts.unusable.clone(),
                        Some(facts) if given.count() > 0 && !facts.is_software && !all.contains(&position) => {
                            Some("Slurm gave this job other GPUs".to_owned())
                        }
                        Some(_) => None,
                    };
                    if let Some(why) = unusable {
                        return Err(Error::NoDevice(format!(
                            "device {position}: {why}; `spectile devices` lists what there is"
                        )));
                    }
                }
                Ok(positions.clone())
            }
            _ if all.is_empty() => {
                let refused = listed.iter().filter_map(|f| Some((&f.name, f.unusable.as_ref()?)));
                let mut reasons: String = refused.map(|(name, why)| format!("; {name}: {why}")).collect();
                if *given != Given::Everything && given.count() == 0 {
                    reasons += "; Slurm gave this job no GPU (--gpus-per-task)";
                }
                Err(Error::NoDevice(format!(
                    "no adapter that can run Spectile{reasons}: install a Vulkan driver for your GPU, or the software driver \
                     (Debian/Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)"
                )))
            }
            Selection::All | Selection::Software => Ok(all),
            Selection::Count(count) => Ok((0..*count).map(|i| all[i % all.len()]).collect()),
        }
    }
}

/// Usable adapters: every GPU that was given, through the first backend that lists it; if there is none, every software
/// adapter.
fn usable_once(listed: &[AdapterFacts], given: &Given) -> Result<Vec<usize>> {
    let gpus = given.among(listed, &usable(listed, false))?;
    Ok(if gpus.is_empty() { software_among(listed) } else { gpus })
}

fn software_among(listed: &[AdapterFacts]) -> Vec<usize> {
    usable(listed, true)
}

/// Usable adapters that are software or are not, each through the first backend that lists it.
fn usable(listed: &[AdapterFacts], software: bool) -> Vec<usize> {
    let is_usable = |facts: &AdapterFacts| facts.unusable.is_none() && facts.is_software == software;
    let backend_of = |name: &str| listed.iter().find(|f| is_usable(f) && f.name == name).map(|f| &f.backend);
    (0..listed.len())
        .filter(|&i| is_usable(&listed[i]) && backend_of(&listed[i].name) == Some(&listed[i].backend))
        .collect()
}

/// The devices of a task whose job asked for GPUs. Software devices stand in only where they are allowed to: they render the
/// same at a hundredth of the speed, which nobody wants unasked on a whole cluster.
pub fn of_task(allow_software: bool) -> Result<Selection> {
    let listed = list();
    let chosen = Selection::All.choose(&listed, &allocation::given()?);
    match chosen {
        Ok(chosen) => match chosen.first().map(|&first| &listed[first]) {
            Some(first) if first.is_software && !allow_software => Err(Error::NoDevice(format!(
                "no GPU is found, only {}, which renders on the CPUs: --allow-software would use it, and --gpus-per-task 0 \
                 asks for nothing else",
                first.name
            ))),
            _ => Ok(Selection::All),
        },
        Err(Error::NoDevice(_)) if allow_software && !software_among(&listed).is_empty() => Ok(Selection::Software),
        Err(error) => Err(error),
    }
}

/// Where `now`, what another Instance lists, has the adapter `listed[index]`: by name, backend, and position among
/// those alike, since an adapter may come or go between two Instances.
fn same_adapter(listed: &[AdapterFacts], index: usize, now: &[AdapterFacts]) -> Option<usize> {
    let wanted = &listed[index];
    let alike = |facts: &AdapterFacts| facts.name == wanted.name && facts.backend == wanted.backend;
    let position = listed[..index].iter().filter(|facts| alike(facts)).count();
    (0..now.len()).filter(|&i| alike(&now[i])).nth(position)
}

impl Gpu {
    /// Opens the best usable adapter: a GPU where there is one, else the software driver.
    pub fn open() -> Result<Gpu> {
        Ok(Self::open_all(&Selection::Count(1))?.remove(0))
    }

    /// Opens the devices of a selection, each through its own wgpu Instance. At least one.
    pub fn open_all(selection: &Selection) -> Result<Vec<Gpu>> {
        let listed = list();
        let chosen = selection.choose(&listed, &allocation::given()?)?;
        chosen.into_iter().map(|index| Self::open_like(&listed, index)).collect()
    }

    /// Opens the adapter that `listed[index]` describes, in an Instance of its own.
    fn open_like(listed: &[AdapterFacts], index: usize) -> Result<Gpu> {
        let identity = Identity::of(listed, index);
        if let Some(kept) = kept::take(&identity) {
            return Ok(Gpu::of(listed[index].name.clone(), listed[index].is_software, kept));
        }
        let instance = instance();
        let mut adapters = sorted_adapters(&instance);
        let now: Vec<AdapterFacts> = adapters.iter().map(facts).collect();
        let wanted = &listed[index];
        let found = same_adapter(listed, index, &now).ok_or_else(|| {
            Error::NoDevice(format!("{} through {} is not there any more: try again", wanted.name, wanted.backend))
        })?;
        let adapter = adapters.swap_remove(found);
        let info = adapter.get_info();
        let wanted = wgpu::Features::TIMESTAMP_QUERY;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("spectile"),
            required_features: adapter.features() & wanted,
            required_limits: adapter.limits(),
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            trace: wgpu::Trace::Off,
        }))
        .map_err(|e| Error::NoDevice(format!("{}: cannot be opened: {e}", info.name)))?;

        let trouble = Arc::new(Mutex::new(None));
        let (on_error, on_lost) = (Arc::clone(&trouble), Arc::clone(&trouble));
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let what = match e {
                wgpu::Error::OutOfMemory { .. } => Trouble::Memory,
                // Its text is a paragraph.
                e => Trouble::Other(e.to_string().split_whitespace().collect::<Vec<_>>().join(" ")),
            };
            note(&on_error, what);
        }));
        device.set_device_lost_callback(move |reason, message| {
            note(&on_lost, Trouble::Lost(format!("device lost ({reason:?}) {message}")));
        });
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        Ok(Gpu::of(info.name, is_software, Kept { identity, device, queue, trouble, instance }))
    }

    fn of(name: String, is_software: bool, open: Kept) -> Gpu {
        let Kept { identity, device, queue, trouble, instance } = open;
        Gpu {
            name,
            is_software,
            limits: device.limits(),
            timestamps: device.features().contains(wgpu::Features::TIMESTAMP_QUERY),
            shader_checks: wgpu::ShaderRuntimeChecks::unchecked(),
            device,
            queue,
            deadline: Arc::default(),
            #[cfg(test)]
            faults: crate::gpu::fault::planned(),
            trouble,
            instance,
            identity,
        }
    }

    /// Notes what [`Gpu::check`] will say.
    pub(crate) fn note(&self, what: Trouble) {
        note(&self.trouble, what);
    }

    fn trouble(&self) -> MutexGuard<'_, Option<Trouble>> {
        self.trouble.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Bytes that its buffers take; `None` where the backend does not tell.
    pub fn allocated_bytes(&self) -> Option<u64> {
        // What is dropped is freed when the device is looked at.
        let _ = self.device.poll(wgpu::PollType::Poll);
        self.device.generate_allocator_report().map(|report| report.total_allocated_bytes)
    }

    /// Whether the device still works; errors that nobody waited for end up here.
    pub fn check(&self) -> Result<()> {
        let name = &self.name;
        match self.trouble().as_ref() {
            None => Ok(()),
            Some(Trouble::Memory) => Err(Error::DeviceMemory(format!(
                "{name}: its memory does not hold the scene and one tile with all its channels: choose a smaller --tile \
                 (`spectile plan` says what is needed)"
            ))),
            Some(Trouble::Hung(waited)) => {
                Err(Error::DevicesLost(format!("{name}: hung: no answer in {:.0} s", waited.as_secs_f64())))
            }
            Some(Trouble::Lost(what) | Trouble::Other(what)) => Err(Error::DevicesLost(format!("{name}: {what}"))),
        }
    }

    /// Forgets that memory ran out, when what took it is free again.
    pub fn forget_out_of_memory(&self) {
        self.trouble().take_if(|trouble| matches!(trouble, Trouble::Memory));
    }

    /// Whether it stopped to answer: then it cannot be closed either, since closing waits for its work.
    pub fn is_hung(&self) -> bool {
        matches!(*self.trouble(), Some(Trouble::Hung(_)))
    }
}

/// The first trouble stays, since what follows is its consequence; but a lost device is that and nothing else.
fn note(trouble: &Mutex<Option<Trouble>>, what: Trouble) {
    let mut trouble = trouble.lock().unwrap_or_else(|e| e.into_inner());
    if trouble.is_none() || matches!(what, Trouble::Lost(_)) {
        *trouble = Some(what);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(name: &str, backend: &str, is_software: bool, unusable: Option<&str>) -> AdapterFacts {
        AdapterFacts {
            name: name.into(),
            backend: backend.into(),
            is_software,
            unusable: unusable.map(str::to_owned),
            ..AdapterFacts::default()
        }
    }

    #[test]
    fn selections_are_read_or_explained() {
        assert_eq!("all".parse(), Ok(Selection::All));
        assert_eq!("3".parse(), Ok(Selection::Count(3)));
        assert_eq!("0,2".parse(), Ok(Selection::List(vec![0, 2])));
        assert_eq!("1,".parse(), Ok(Selection::List(vec![1])));
        for bad in ["", "0", "65", "-1", "two", ",", "0,x", "1.5"] {
            assert!(bad.parse::<Selection>().unwrap_err().contains("spectile devices"), "{bad}");
        }
    }

    /// Two equal GPUs and a third, each listed by two backends, one of them unusable in one; a software device.
    #[test]
    fn every_gpu_counts_once_and_software_only_stands_in() {
        let listed = [
            adapter("A", "vulkan", false, None),
            adapter("A", "vulkan", false, None),
            adapter("B", "vulkan", false, Some("too small")),
            adapter("A", "dx12", false, None),
            adapter("A", "dx12", false, None),
            adapter("B", "dx12", false, None),
            adapter("soft", "vulkan", true, None),
        ];
        assert_eq!(Selection::All.choose(&listed, &Given::Everything).unwrap(), [0, 1, 5]);
        assert_eq!(Selection::Count(2).choose(&listed, &Given::Everything).unwrap(), [0, 1]);
        assert_eq!(Selection::Count(4).choose(&listed, &Given::Everything).unwrap(), [0, 1, 5, 0]);
        assert_eq!(Selection::List(vec![6, 1]).choose(&listed, &Given::Everything).unwrap(), [6, 1]);
        assert_eq!(Selection::List(vec![2]).choose(&listed, &Given::Everything).unwrap_err().exit_code(), 3);
        assert_eq!(Selection::List(vec![7]).choose(&listed, &Given::Everything).unwrap_err().exit_code(), 3);
        assert_eq!(Selection::All.choose(&listed[6..], &Given::Everything).unwrap(), [0]);
        assert_eq!(Selection::All.choose(&[], &Given::Everything).unwrap_err().exit_code(), 3);
        // In a job of Slurm's: what it gave, the software device where that is nothing, and more only if it said nothing.
        let (first, none) = (Given::Places(vec![0]), Given::Places(vec![]));
        assert_eq!(Selection::All.choose(&listed[..2], &first).unwrap(), [0]);
        assert_eq!(Selection::Count(2).choose(&listed[..2], &first).unwrap(), [0, 0]);
        let other = Selection::List(vec![1]).choose(&listed[..2], &first).unwrap_err();
        assert!(other.to_string().contains("device 1: Slurm gave this job other GPUs"), "{other}");
        assert_eq!(Selection::All.choose(&listed, &none).unwrap(), [6]);
        assert_eq!(Selection::List(vec![1]).choose(&listed, &none).unwrap(), [1]);
        let nothing = Selection::All.choose(&listed[..2], &none).unwrap_err();
        assert!(nothing.to_string().contains("Slurm gave this job no GPU"), "{nothing}");
    }

    /// Adapters that come or go between two Instances do not make a device another one.
    #[test]
    fn an_adapter_is_found_again_in_another_instance() {
        let [a, b, a_dx] = [("A", "vulkan"), ("B", "vulkan"), ("A", "dx12")].map(|(n, w)| adapter(n, w, false, None));
        let listed = [a.clone(), b.clone(), a.clone(), a_dx.clone()];
        let now = [b.clone(), a_dx.clone(), a.clone(), a.clone()];
        assert_eq!([0, 1, 2, 3].map(|i| same_adapter(&listed, i, &now)), [Some(2), Some(0), Some(3), Some(1)]);
        // One of two equals is gone: the first is still there, the second is not.
        let fewer = [b, a];
        assert_eq!([0, 2].map(|i| same_adapter(&listed, i, &fewer)), [Some(1), None]);
    }
}
