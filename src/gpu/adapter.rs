//! Adapters and devices: which there are, what they can do, and one opened for work.

use std::sync::{Arc, Mutex};

use serde::Serialize;

use crate::{Error, Result};

/// What `spectile devices` says of one adapter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AdapterFacts {
    pub name: String,
    pub backend: String,
    /// `discrete GPU`, `integrated GPU`, `virtual GPU`, `CPU (software)` or `other`.
    pub kind: String,
    pub driver: String,
    /// Largest buffer that one binding can show, bytes.
    pub max_binding: u64,
    pub max_buffer: u64,
    pub timestamps: bool,
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
    trouble: Arc<Mutex<Option<Trouble>>>,
    _instance: wgpu::Instance,
}

/// The first thing that went wrong on a device.
enum Trouble {
    Memory,
    Other(String),
}

/// Storage buffers that the largest pass binds at once, generate_bounce under roulette: 3 of the scene, 4 windows each of
/// nodes and primitives, 8 of the wave.
pub const STORAGE_BUFFERS: u32 = 19;

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    wgpu::Instance::new(descriptor)
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
    let unusable = if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
        Some(format!(
            "binds {} storage buffers, {STORAGE_BUFFERS} are needed",
            limits.max_storage_buffers_per_shader_stage
        ))
    } else if limits.max_compute_invocations_per_workgroup < 256 {
        Some("its compute workgroups are smaller than 256".to_owned())
    } else {
        None
    };
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
        max_binding: limits.max_storage_buffer_binding_size,
        max_buffer: limits.max_buffer_size,
        timestamps: adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        unusable,
    }
}

/// Every adapter of this machine, GPUs first.
pub fn list() -> Vec<AdapterFacts> {
    let mut adapters = adapters(&instance());
    adapters.sort_by_key(|a| rank(&a.get_info()));
    adapters.iter().map(facts).collect()
}

impl Gpu {
    /// Opens the best usable adapter: a GPU where there is one, else the software driver.
    pub fn open() -> Result<Gpu> {
        let instance = instance();
        let mut adapters = adapters(&instance);
        adapters.sort_by_key(|a| rank(&a.get_info()));
        let refused: Vec<_> = adapters.iter().map(facts).filter_map(|f| Some((f.name, f.unusable?))).collect();
        let Some(adapter) = adapters.into_iter().find(|a| facts(a).unusable.is_none()) else {
            let reasons: String = refused.iter().map(|(name, why)| format!("; {name}: {why}")).collect();
            return Err(Error::NoDevice(format!(
                "no adapter that can run Spectile{reasons}: install a Vulkan driver for your GPU, or the software driver \
                 (Debian/Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)"
            )));
        };
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
        let note = |trouble: &Arc<Mutex<Option<Trouble>>>| {
            let trouble = Arc::clone(trouble);
            move |what: Trouble| {
                trouble.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(what);
            }
        };
        let (on_error, on_lost) = (note(&trouble), note(&trouble));
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            on_error(match e {
                wgpu::Error::OutOfMemory { .. } => Trouble::Memory,
                e => Trouble::Other(e.to_string()),
            });
        }));
        device.set_device_lost_callback(move |reason, message| {
            on_lost(Trouble::Other(format!("device lost ({reason:?}) {message}")));
        });
        Ok(Gpu {
            name: info.name,
            is_software: info.device_type == wgpu::DeviceType::Cpu,
            limits: device.limits(),
            timestamps: device.features().contains(wgpu::Features::TIMESTAMP_QUERY),
            shader_checks: wgpu::ShaderRuntimeChecks::unchecked(),
            device,
            queue,
            trouble,
            _instance: instance,
        })
    }

    /// Whether the device still works; errors that nobody waited for end up here.
    pub fn check(&self) -> Result<()> {
        match self.trouble.lock().unwrap_or_else(|e| e.into_inner()).as_ref() {
            Some(Trouble::Other(what)) => Err(Error::DevicesLost(format!("{}: {what}", self.name))),
            Some(Trouble::Memory) => Err(Error::Usage(format!(
                "{}: its memory does not hold the scene and one tile with all its channels: choose a smaller --tile \
                 (`spectile plan` says what is needed)",
                self.name
            ))),
            None => Ok(()),
        }
    }
}
