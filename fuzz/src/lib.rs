//! What the fuzz targets share: scripts are loaded as the program does, from a file and with someone
//! looking after their ceilings on time and memory.

use std::path::PathBuf;
use std::sync::LazyLock;

use runner::script::{CountingAllocator, Diagnostic, Plan, load, start_watching};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// The script being loaded. Several processes fuzz at a time, each with a file of its own.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/scratch"));
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    // The program would end the process of a script that cannot be stopped; here libFuzzer does, and
    // tells such inputs from those that crash.
    start_watching(None, |_| {}, || false).expect("a thread can be started");
    folder.join(format!("script-{}.rhai", std::process::id()))
});

/// Loads a script of this `text`.
pub fn load_text(text: &[u8]) -> Result<Plan, Diagnostic> {
    std::fs::write(&*FILE, text).expect("the script can be written");
    load(&FILE)
}
