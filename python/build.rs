//! On macOS the symbols of Python are found when the library is loaded, which its linker has to be told.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
