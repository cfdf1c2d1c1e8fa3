//! Options of the linker, for WebAssembly.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_FAMILY").is_ok_and(|family| family == "wasm") {
        // Postures and normal equations live on the stack: a megabyte, the default, is not enough for them.
        println!("cargo::rustc-link-arg-cdylib=-zstack-size=8388608");
        println!("cargo::rustc-link-arg-cdylib=--strip-all");
    }
}
