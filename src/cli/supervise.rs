//! Commands that run scripts do so in a child process of the same program: a native stack that
//! overflows, or a machine that runs out of memory, ends the child, and what is left says why.
//!
//! The child has the same arguments, terminal, folder and environment. Signals of the terminal
//! reach both processes; those that are sent to the one that was started are sent on. When that one
//! dies, the child does too.

use std::io;
use std::process::ExitCode;

use super::output;
use crate::script::{Diagnostic, start_watching};

/// Stack of the thread on which a command runs, and of those it starts. Rhai's limits allow values
/// of 16,384 arrays in each other, which are copied, compared and dropped by recursion.
const STACK: usize = 64 << 20;
/// Marks the child: the parent's process id, and the number of the descriptor of the ledger, in which
/// the child says what it does.
#[cfg(unix)]
const MARK: &str = "RUNNER_SUPERVISED";

/// Runs `command`, which may run scripts, in a child process.
pub(super) fn supervised(command: impl FnOnce() -> ExitCode + Send) -> ExitCode {
    #[cfg(unix)]
    {
        use unix::{Role, role};
        match role() {
            Role::Child { parent, ledger } => {
                return guarded(command, ledger, move || unix::parent() != Some(parent));
            }
            Role::Parent => {
                if let Ok(ended) = unix::watch_over(std::env::args_os().skip(1)) {
                    return ended;
                }
                // No process can be started here: then without.
            }
        }
    }
    guarded(command, None, || false)
}

/// Runs `command` under the ceilings on time and memory.
fn guarded(
    command: impl FnOnce() -> ExitCode + Send,
    ledger: Option<std::fs::File>,
    orphaned: impl Fn() -> bool + Send + 'static,
) -> ExitCode {
    // Without somebody who looks, operations are still counted.
    let _ = start_watching(ledger, end, orphaned);
    let mut command = Some(command);
    let mut run = || command.take().map_or(ExitCode::FAILURE, |command| command());
    let outcome = std::thread::scope(|scope| {
        let main = std::thread::Builder::new().name("main".into()).stack_size(STACK);
        let thread = main.spawn_scoped(scope, &mut run).ok()?;
        Some(thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });
    // Where no such stack is to be had, on the one there is.
    outcome.unwrap_or_else(run)
}

/// Ends this process over what a script does: at once, for one of its threads stands still.
fn end(diagnostic: Option<&Diagnostic>) {
    use io::{IsTerminal, Write};
    if let Some(diagnostic) = diagnostic {
        if io::stderr().is_terminal() {
            // The progress bar's line.
            let _ = write!(io::stderr(), "\r\x1b[2K");
        }
        output::diagnostic(diagnostic);
    }
    #[cfg(unix)]
    signal_hook::low_level::exit(2);
    #[cfg(not(unix))]
    #[expect(clippy::disallowed_methods, reason = "a thread stands still: nothing else ends it")]
    std::process::exit(2);
}

#[cfg(unix)]
pub(super) mod unix {
    use std::ffi::OsString;
    use std::fs::File;
    use std::io::{self, Write};
    use std::os::fd::AsRawFd;
    use std::os::unix::process::{CommandExt, ExitStatusExt};
    use std::path::PathBuf;
    use std::process::{Command, ExitCode, ExitStatus};

    use nix::sys::signal::{SigSet, Signal as Blocked};
    use rustix::process::{
        Pid, Resource, Rlimit, Signal, getppid, kill_process, set_parent_process_death_signal,
        setrlimit,
    };
    use signal_hook::consts::{SIGABRT, SIGBUS, SIGHUP, SIGINT, SIGKILL, SIGSEGV, SIGTERM};
    use signal_hook::iterator::SignalsInfo;
    use signal_hook::iterator::exfiltrator::raw::WithRawSiginfo;
    use signal_hook::low_level::emulate_default_handler;

    use super::super::output;
    use super::{MARK, STACK};
    use crate::script::{Diagnostic, read_ledger};

    /// Which of the two processes this one is.
    pub(super) enum Role {
        Parent,
        Child { parent: Pid, ledger: Option<File> },
    }

    pub(super) fn parent() -> Option<Pid> {
        getppid()
    }

    /// Finds it out, and prepares the child.
    pub(super) fn role() -> Role {
        let mark = std::env::var(MARK).unwrap_or_default();
        let mut numbers = mark.split(':').map(|n| n.parse::<i32>().ok());
        let (of, descriptor) = (numbers.next().flatten(), numbers.next().flatten());
        // A mark that was inherited from further up is not for this process.
        let Some(parent) = of.and_then(Pid::from_raw).filter(|p| getppid() == Some(*p)) else {
            return Role::Parent;
        };
        let _ = set_parent_process_death_signal(Some(Signal::KILL));
        // Rust's handler of a stack overflow speaks of threads, and aborts. A blocked fault ends the
        // process without it, and the parent says what happened. No file is left of it.
        let mut faults = SigSet::empty();
        faults.add(Blocked::SIGSEGV);
        faults.add(Blocked::SIGBUS);
        let _ = faults.thread_block();
        let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) });
        let open = |n: i32| File::options().write(true).open(format!("/dev/fd/{n}")).ok();
        Role::Child { parent, ledger: descriptor.and_then(open) }
    }

    /// What a child process says of itself, for when it dies.
    #[derive(Debug)]
    pub(in super::super) struct Ledger(Option<File>);

    impl Ledger {
        /// Why the child died, if it is to blame on what it ran; exit code 2.
        pub(in super::super) fn death(&mut self, status: ExitStatus) -> Option<Diagnostic> {
            let d = match status.signal()? {
                SIGSEGV | SIGBUS => Diagnostic::error("the script has overflowed the stack")
                    .hint("does it put values into each other without end?"),
                SIGABRT => Diagnostic::error("there is not enough memory for this run")
                    .hint("large networks, replay buffers and tables take most"),
                SIGKILL => Diagnostic::error("the run was killed from outside")
                    .hint("the system does so when its memory is used up: `dmesg` would say so"),
                _ => return None,
            };
            Some(match &mut self.0 {
                Some(file) => read_ledger(file, d),
                None => d,
            })
        }
    }

    /// A command that runs this program once more, with `args`, watched over; its [`Ledger`] tells why
    /// it died, if it did.
    pub(in super::super) fn child(
        args: impl IntoIterator<Item = OsString>,
    ) -> io::Result<(Command, Ledger)> {
        // The file may have been replaced since this process was started.
        let program = std::env::current_exe().ok().filter(|p| p.exists());
        let mut command = Command::new(program.unwrap_or(PathBuf::from("/proc/self/exe")));
        if let Some(name) = std::env::args_os().next() {
            command.arg0(name);
        }
        let ledger = tempfile::tempfile().ok();
        if let Some(file) = &ledger {
            rustix::io::fcntl_setfd(file, rustix::io::FdFlags::empty())?;
        }
        let descriptor = ledger.as_ref().map_or(-1, AsRawFd::as_raw_fd);
        command
            .args(args)
            .env(MARK, format!("{}:{descriptor}", std::process::id()))
            .env("RUST_MIN_STACK", STACK.to_string());
        Ok((command, Ledger(ledger)))
    }

    /// Runs this program's child with `args` and waits for its end.
    pub(super) fn watch_over(args: impl IntoIterator<Item = OsString>) -> io::Result<ExitCode> {
        let (mut command, mut ledger) = child(args)?;
        // From here on these signals do not end this process.
        let mut signals = SignalsInfo::<WithRawSiginfo>::new([SIGINT, SIGTERM, SIGHUP])?;
        let mut child = command.spawn()?;
        let process = Pid::from_child(&child);
        std::thread::Builder::new().name("signals".into()).spawn(move || {
            for info in signals.forever() {
                let signal = match info.si_signo {
                    SIGINT => Signal::INT,
                    SIGTERM => Signal::TERM,
                    _ => Signal::HUP,
                };
                if !reached_both(info.si_signo, info.si_code) {
                    let _ = kill_process(process, signal);
                }
            }
        })?;
        let status = child.wait()?;
        if let Some(code) = status.code() {
            return Ok(ExitCode::from(code as u8));
        }
        if let Some(diagnostic) = ledger.death(status) {
            let _ = io::stdout().flush();
            output::diagnostic(&diagnostic);
            return Ok(ExitCode::from(2));
        }
        // Whoever started this process sees what he would see of the child.
        let signal = status.signal().unwrap_or(SIGTERM);
        let _ = emulate_default_handler(signal);
        Ok(ExitCode::from(128_u8.wrapping_add(signal as u8)))
    }

    /// Whether a signal came from the terminal, which sends it to every process in front of it: then
    /// the child has got it too.
    #[cfg(target_os = "linux")]
    fn reached_both(_signal: i32, code: i32) -> bool {
        // Positive codes are the kernel's, others those of a process that has sent it.
        code > 0
    }

    /// Elsewhere the code does not tell.
    #[cfg(not(target_os = "linux"))]
    fn reached_both(signal: i32, _code: i32) -> bool {
        signal == SIGINT && io::IsTerminal::is_terminal(&io::stdin())
    }
}
