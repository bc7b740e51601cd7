//! A compute pass: a composed shader, its pipeline, and bindings found by the names they have in the WGSL.

use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;
use crate::gpu::source::Source;
use crate::{Error, Result};

/// A compute pipeline whose bind groups are made from the shader's own declarations.
pub struct Pass {
    pub label: &'static str,
    pub pipeline: wgpu::ComputePipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    bindings: Vec<Binding>,
}

/// One `@group @binding var` of the shader.
#[derive(Debug, Clone, PartialEq)]
struct Binding {
    group: u32,
    binding: u32,
    name: String,
    uniform: bool,
    read_only: bool,
}

/// The uniform that changes from dispatch to dispatch of a wave is bound with a dynamic offset.
const DYNAMIC: &str = "step";

impl Pass {
    /// Compiles `source`, whose entry point is called like its file. Errors: a defect of the text; more storage buffers than the device
    /// binds.
    pub fn new(gpu: &Gpu, source: &Source) -> Result<Pass> {
        let module = source.parse()?;
        let entry = module.entry_points.first().map(|e| e.name.clone());
        let entry = entry.ok_or_else(|| Error::Internal(format!("{} has no entry point", source.label)))?;
        let bindings = bindings(&module);
        let needed = bindings.iter().filter(|b| !b.uniform).count() as u32;
        let most = gpu.limits.max_storage_buffers_per_shader_stage;
        if needed > most {
            return Err(Error::NoDevice(format!(
                "{}: {} binds {needed} storage buffers for this scene, and this device {most} at most: use another device, or a \
                 scene with fewer kinds of materials, lights, textures or media",
                gpu.name, source.label
            )));
        }
        let groups = bindings.iter().map(|b| b.group + 1).max().unwrap_or(0);
        let device = &gpu.device;
        let layouts: Vec<_> = (0..groups)
            .map(|group| {
                let entries: Vec<_> = bindings.iter().filter(|b| b.group == group).map(layout_entry).collect();
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: Some(source.label),
                    entries: &entries,
                })
            })
            .collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(source.label),
            bind_group_layouts: &layouts.iter().map(Some).collect::<Vec<_>>(),
            immediate_size: 0,
        });
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(source.label),
            source: wgpu::ShaderSource::Wgsl(source.text.as_str().into()),
        };
        // SAFETY: bounds checks and loop bounding are left out, which took 5 to 25 % of kernels on lavapipe. Every index that these
        // shaders compute stays within the buffers that `render::worker` sizes for them, and every loop is bounded by
        // its own counter; the tests also run them with the checks on.
        let module = unsafe { device.create_shader_module_trusted(descriptor, gpu.shader_checks) };
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(source.label),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(&entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: None,
        });
        Ok(Pass { label: source.label, pipeline, layouts, bindings })
    }

    /// A bind group for `group`, each buffer looked up by the name of its variable.
    pub fn bind<'a>(
        &self,
        gpu: &Gpu,
        group: u32,
        find: impl Fn(&str) -> Option<wgpu::BufferBinding<'a>>,
    ) -> Result<wgpu::BindGroup> {
        let entries = self
            .bindings
            .iter()
            .filter(|b| b.group == group)
            .map(|b| {
                let buffer = find(&b.name)
                    .ok_or_else(|| Error::Internal(format!("{}: nothing to bind to `{}`", self.label, b.name)))?;
                Ok(wgpu::BindGroupEntry { binding: b.binding, resource: wgpu::BindingResource::Buffer(buffer) })
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.label),
            layout: &self.layouts[group as usize],
            entries: &entries,
        }))
    }

    /// Runs it once over so many workgroups, each buffer looked up by the name of its variable, and waits for it: for kernels beside
    /// the render.
    pub fn run<'a>(
        &self,
        gpu: &Gpu,
        [x, y]: [u32; 2],
        find: impl Fn(&str) -> Option<wgpu::BufferBinding<'a>>,
    ) -> Result<()> {
        let groups =
            (0..self.layouts.len() as u32).map(|group| self.bind(gpu, group, &find)).collect::<Result<Vec<_>>>()?;
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some(self.label) };
        let mut encoder = gpu.device.create_command_encoder(&descriptor);
        {
            let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            compute.set_pipeline(&self.pipeline);
            for (index, group) in groups.iter().enumerate() {
                let dynamic = self.bindings.iter().filter(|b| b.group == index as u32 && b.name == DYNAMIC).count();
                compute.set_bind_group(index as u32, group, &vec![0; dynamic]);
            }
            compute.dispatch_workgroups(x, y, 1);
        }
        buffer::wait(gpu, gpu.queue.submit([encoder.finish()]), buffer::WARM_UP)
    }
}

/// Workgroup counts in x and y for at least `groups` groups: a dimension takes at most 65,535.
pub fn grid(groups: u32) -> [u32; 2] {
    let y = groups.div_ceil(65_535).max(1);
    [groups.div_ceil(y), y]
}

/// Storage buffers that a kernel binds.
pub fn storage_buffers(source: &Source) -> Result<u32> {
    Ok(bindings(&source.parse()?).iter().filter(|b| !b.uniform).count() as u32)
}

fn bindings(module: &naga::Module) -> Vec<Binding> {
    let mut found: Vec<_> = module
        .global_variables
        .iter()
        .filter_map(|(_, v)| {
            let at = v.binding.as_ref()?;
            let read_only = match v.space {
                naga::AddressSpace::Storage { access } => !access.contains(naga::StorageAccess::STORE),
                _ => true,
            };
            Some(Binding {
                group: at.group,
                binding: at.binding,
                name: v.name.clone()?,
                uniform: v.space == naga::AddressSpace::Uniform,
                read_only,
            })
        })
        .collect();
    found.sort_by_key(|b| (b.group, b.binding));
    found
}

fn layout_entry(b: &Binding) -> wgpu::BindGroupLayoutEntry {
    let ty = if b.uniform {
        wgpu::BufferBindingType::Uniform
    } else {
        wgpu::BufferBindingType::Storage { read_only: b.read_only }
    };
    wgpu::BindGroupLayoutEntry {
        binding: b.binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: b.name == DYNAMIC, min_binding_size: None },
        count: None,
    }
}
