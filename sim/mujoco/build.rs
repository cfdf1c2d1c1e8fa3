//! Tells the program where to find its Python at run time.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Otherwise the loader silently takes any libpython of that name on the system, and with it another Python's modules.
    pyo3_build_config::add_libpython_rpath_link_args();
    let python = pyo3_build_config::get();
    let executable = python.executable().expect("pyo3 is built against a Python that runs");
    println!("cargo::rustc-env=CALIBENCH_PYTHON={executable}");
    if let Some(folder) = python.lib_dir() {
        println!("cargo::metadata=lib_dir={folder}");
    }
}
