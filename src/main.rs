//! The `runner` command; everything is in the library.

use std::process::ExitCode;

/// Counts what each thread takes, so that no script takes all there is.
#[global_allocator]
static ALLOCATOR: runner::script::CountingAllocator = runner::script::CountingAllocator;

fn main() -> ExitCode {
    runner::cli::main()
}
