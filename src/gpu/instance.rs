//! wgpu's Instance, for a program without windows.

/// A new Instance with every backend that Spectile works through.
pub fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    #[cfg(target_os = "linux")]
    if let Some(instance) = without_wayland(&descriptor) {
        return instance;
    }
    wgpu::Instance::new(descriptor)
}

/// As `descriptor` says, for Vulkan, without the extension that presents pictures in Wayland's windows; `None` where there is no
/// Vulkan.
///
/// wgpu asks for that extension wherever there is one, display or not. A layer that Mesa puts before every driver then looks for a
/// compositor whose GPU to list first, and where no session is (cron, containers, ssh) libwayland writes to stderr, four times,
/// that XDG_RUNTIME_DIR is not set. A variable of our own would silence that, but would have to be set before there are threads,
/// and jobs and programs that we start would inherit it.
#[cfg(target_os = "linux")]
fn without_wayland(descriptor: &wgpu::InstanceDescriptor) -> Option<wgpu::Instance> {
    use wgpu::hal::{self, vulkan};

    let same = hal::InstanceDescriptor {
        name: "spectile",
        flags: descriptor.flags,
        memory_budget_thresholds: descriptor.memory_budget_thresholds,
        backend_options: descriptor.backend_options.clone(),
        telemetry: None,
        display: None,
    };
    let leave_out = |arguments: vulkan::CreateInstanceCallbackArgs| {
        arguments.extensions.retain(|name| *name != c"VK_KHR_wayland_surface");
    };
    // SAFETY: wgpu-hal wants nothing removed that it relies on later. What it does with this extension is to make surfaces for
    // windows of Wayland, which nobody here asks for, and it looks whether it has been enabled before it does. The instance is
    // a new one, and nobody else has it.
    unsafe {
        let instance = vulkan::Instance::init_with_callback(&same, Some(Box::new(leave_out))).ok()?;
        Some(wgpu::Instance::from_hal::<hal::api::Vulkan>(instance))
    }
}
