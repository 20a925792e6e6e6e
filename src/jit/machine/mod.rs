//! Machine code from programs, by Cranelift.
//!
//! - [`Code`]: a program's machine code, which owns the memory it lies in
//! - `build`: statements as blocks of Cranelift's form; `value`: expressions as its values
//! - `range`: what is known of them
//!
//! The code has the host's calling convention and takes the address of its inputs. It returns a float,
//! or an integer (a truth value is 0 or 1); a trap returns [`Output::TRAP`](super::Output).

mod build;
mod code;
mod range;
mod value;

use std::fmt;
use std::sync::OnceLock;

use cranelift_codegen::isa::{OwnedTargetIsa, TargetIsa};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_codegen::{Context, ir};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Linkage, Module, ModuleError, default_libcall_names};

use super::check::Invalid;
use super::ir::{Program, Table, Type};

pub(super) use code::Code;

/// Bytes that the local arrays of a program may take, on the stack of whoever calls it.
const MAX_FRAME: usize = 64 * 1024;

/// Inputs of a program.
const MAX_INPUTS: usize = 1 << 20;

/// Why there is no machine code.
#[derive(Debug)]
pub(super) enum Error {
    /// The program is ill formed.
    Invalid(Invalid),
    /// The host cannot run machine code of ours, or Cranelift does not compile the program.
    Refused(String),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Invalid(invalid) => invalid.fmt(f),
            Self::Refused(why) => write!(f, "no machine code: {why}"),
        }
    }
}

impl std::error::Error for Error {}

impl From<ModuleError> for Error {
    fn from(error: ModuleError) -> Self {
        Self::Refused(error.to_string())
    }
}

/// What compiles for this host; made once.
fn host() -> Result<OwnedTargetIsa, Error> {
    static HOST: OnceLock<Result<OwnedTargetIsa, String>> = OnceLock::new();
    HOST.get_or_init(find_host).clone().map_err(Error::Refused)
}

fn find_host() -> Result<OwnedTargetIsa, String> {
    let mut flags = settings::builder();
    for (name, value) in [
        ("opt_level", "speed"),
        ("is_pic", "false"),
        ("use_colocated_libcalls", "false"),
        // Nothing unwinds through the code: what it calls aborts instead of panicking.
        ("unwind_info", "false"),
        // A local array must not reach past the guard page of the stack.
        ("enable_probestack", "true"),
        ("probestack_strategy", "inline"),
        ("enable_verifier", if cfg!(debug_assertions) { "true" } else { "false" }),
    ] {
        flags.set(name, value).map_err(|e| e.to_string())?;
    }
    let isa = cranelift_native::builder()?
        .finish(settings::Flags::new(flags))
        .map_err(|e| e.to_string())?;
    // Without it, rounding is a call to the platform's library, wherever that is.
    let rounds = |f: &settings::Value| f.name == "has_sse41" && f.as_bool() == Some(true);
    if cfg!(target_arch = "x86_64") && !isa.isa_flags().iter().any(rounds) {
        return Err("the processor has no SSE4.1".to_owned());
    }
    if isa.pointer_type() != ir::types::I64 {
        return Err("addresses of the host do not have 64 bits".to_owned());
    }
    Ok(isa)
}

/// The constants of all tables, one after the other, as bits.
fn constants(program: &Program) -> Box<[u64]> {
    let mut pool = Vec::new();
    for table in &program.tables {
        match table {
            Table::Float(list) => pool.extend(list.iter().map(|x| x.to_bits())),
            Table::Int(list) => pool.extend(list.iter().map(|x| *x as u64)),
        }
    }
    pool.into_boxed_slice()
}

/// The function of a program that has been checked. `constants` is the address of [`constants`].
fn function(program: &Program, constants: i64, isa: &dyn TargetIsa) -> Result<Context, Error> {
    if program.arrays.iter().map(|a| a.1).sum::<usize>() > MAX_FRAME / 8 {
        return Err(Error::Refused("its arrays are too large".to_owned()));
    }
    if program.n_inputs > MAX_INPUTS {
        return Err(Error::Refused("it has too many inputs".to_owned()));
    }
    let mut context = Context::new();
    let signature = &mut context.func.signature;
    signature.call_conv = isa.default_call_conv();
    signature.params.push(ir::AbiParam::new(ir::types::I64));
    signature.returns.push(ir::AbiParam::new(match program.result {
        Type::Float => ir::types::F64,
        Type::Int | Type::Bool => ir::types::I64,
    }));
    let mut scratch = FunctionBuilderContext::new();
    let builder = FunctionBuilder::new(&mut context.func, &mut scratch);
    build::function(program, constants, builder, isa.frontend_config());
    Ok(context)
}

/// The module of a program that has been checked, with its only function.
fn module(program: &Program, constants: i64) -> Result<(JITModule, FuncId), Error> {
    let isa = host()?;
    let mut context = function(program, constants, &*isa)?;
    let mut module = JITModule::new(JITBuilder::with_isa(isa, default_libcall_names()));
    let id = module.declare_function("program", Linkage::Export, &context.func.signature)?;
    module.define_function(id, &mut context)?;
    module.finalize_definitions()?;
    Ok((module, id))
}

/// The machine code of a program, to be looked at.
#[cfg(all(test, target_arch = "x86_64"))]
pub(super) fn listing(program: &Program) -> String {
    let isa = host().unwrap();
    let mut context = function(program, 0, &*isa).unwrap();
    context.set_disasm(true);
    let mut plane = cranelift_codegen::control::ControlPlane::default();
    let code = context.compile(&*isa, &mut plane).unwrap();
    code.vcode.clone().unwrap()
}
