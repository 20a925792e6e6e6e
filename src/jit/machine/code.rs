//! The machine code of a program, and all unsafe code there is around it.
//!
//! What makes it sound:
//! 1. The program has been checked: every type fits, every input is below `n_inputs`, every table and
//!    array exists. The code reads its inputs, its tables, its constants and its own frame, writes its
//!    own frame only, and compares every index that is not constant with the length first.
//! 2. The code has the calling convention of `extern "C"`, one address as parameter, and a result of
//!    the type that [`Output::holds`] says.
//! 3. It is called with the address of at least `n_inputs` floats that are borrowed for as long as the
//!    call lasts, and keeps no address.
//! 4. The memory of the code and of the tables belongs to [`Code`] and lives as long as it does;
//!    whoever calls borrows it, so that nothing runs when it is freed. Neither is ever written to after
//!    `new`, and the code has no state: any number of threads may be in it.
//! 5. The functions that it calls are `extern "C"` of one or two floats, and do not unwind.

#![allow(unsafe_code)]

use std::fmt;
use std::sync::Mutex;

use cranelift_jit::JITModule;

use super::{Error, constants, module};
use crate::jit::ir::Program;
use crate::jit::kernel::Output;

/// The machine code of a program. Any number of threads may call it.
pub(in crate::jit) struct Code<R> {
    entry: unsafe extern "C" fn(*const f64) -> R,
    n_inputs: usize,
    /// What the code lies in; taken when it is freed. Never locked: it makes this `Sync`.
    module: Mutex<Option<Box<JITModule>>>,
    /// What its tables lie in.
    _constants: Box<[u64]>,
}

impl<R: Output> Code<R> {
    /// Compiles `program`.
    ///
    /// # Errors
    /// If the program is ill formed or its result is not an `R`; if this host has no machine code, or
    /// the program is too large for it.
    pub(in crate::jit) fn new(program: &Program) -> Result<Self, Error> {
        program.check().and_then(|()| program.returns::<R>()).map_err(Error::Invalid)?;
        let constants = constants(program);
        let (module, id) = module(program, constants.as_ptr().expose_provenance() as i64)?;
        let entry = module.get_finalized_function(id);
        // SAFETY: the address is that of the code just compiled, with this signature (2), and is
        // valid until the module is freed (4).
        let entry = unsafe {
            std::mem::transmute::<*const u8, unsafe extern "C" fn(*const f64) -> R>(entry)
        };
        let module = Mutex::new(Some(Box::new(module)));
        Ok(Self { entry, n_inputs: program.n_inputs, module, _constants: constants })
    }

    /// What the program returns, or [`Output::TRAP`].
    ///
    /// # Panics
    /// If there are fewer inputs than the program reads.
    #[inline]
    pub(in crate::jit) fn call(&self, inputs: &[f64]) -> R {
        assert!(inputs.len() >= self.n_inputs, "fewer inputs than the program reads");
        // SAFETY: there are enough inputs, borrowed until it returns (3); the code is the program's
        // (1, 2), and alive since `self` is (4).
        unsafe { (self.entry)(inputs.as_ptr()) }
    }
}

impl<R> Drop for Code<R> {
    fn drop(&mut self) {
        if let Some(module) = self.module.get_mut().ok().and_then(Option::take) {
            // SAFETY: nobody borrows `self`, so the code is not running, and its address, which never
            // left `self`, is not called again (4).
            unsafe { module.free_memory() };
        }
    }
}

impl<R> fmt::Debug for Code<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Code").field("n_inputs", &self.n_inputs).finish_non_exhaustive()
    }
}
