//! Lets cargo build the service anew when the page in `target/dashboard` is another one.

use std::path::Path;

fn main() {
    let page = Path::new("../target/dashboard");
    // Cargo runs this each time where the directory is missing, so an empty one stands for a page
    // that was not built. Where it cannot be made, the build is right and takes longer.
    let _ = std::fs::create_dir_all(page);
    println!("cargo::rerun-if-changed={}", page.display());
    println!("cargo::rerun-if-changed=build.rs");
}
