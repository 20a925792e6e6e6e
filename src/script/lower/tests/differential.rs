//! Programs run three ways: by the interpreter, by the evaluator of the intermediate form, and as
//! machine code. All three must agree, to the bit.

use std::rc::Rc;

use rhai::Dynamic;

use super::super::{Library, Outside, Param, Subject, Want, lower};
use super::generator::{Generator, Ty};
use crate::jit::{Kernel, Program, Value, ir};
use crate::mdp::{Field, Schema};
use crate::script::callback::{Callbacks, cell_index};
use crate::script::diagnostic::Diagnostic;
use crate::script::engine::{CALLBACK_OPERATIONS, Context, compile, engine};
use crate::script::prepared::Prepared;
use crate::script::source::SourceSet;
use crate::script::state::{State, StepView};
use crate::script::value::Value as Constant;
use crate::shaping::StepLayout;

/// States of two floats and an integer.
fn schema() -> Schema {
    Schema {
        fields: vec![
            Field::float("x", "", -1.0, 1.0),
            Field::float("y", "", -1.0, 1.0),
            Field::int("n", "", 0, 9),
        ],
        facts: Vec::new(),
        actions: Vec::new(),
        grid: None,
    }
}

/// A compiled script.
pub(super) struct Bench {
    host: Rc<Callbacks>,
    text: String,
    schema: Rc<Schema>,
}

/// What a program gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// A float, by its bits; every NaN is the same.
    Float(u64),
    Int(i64),
    Bool(bool),
    /// An error, or a trap.
    Error,
}

fn float(x: f64) -> Outcome {
    Outcome::Float(if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() })
}

/// A step's numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) state: [f64; 3],
    pub(super) next_state: [f64; 3],
    pub(super) action: i64,
    pub(super) reward: f64,
    pub(super) terminated: bool,
    pub(super) truncated: bool,
    pub(super) number: i64,
}

impl Step {
    fn random(g: &mut Generator) -> Self {
        let mut state = || [g.float_input(), g.float_input(), g.int_input() as f64];
        let (state, next_state) = (state(), state());
        Self {
            state,
            next_state,
            action: g.int_input(),
            reward: g.float_input(),
            terminated: g.int_input() % 2 == 0,
            truncated: g.int_input() % 2 == 0,
            number: g.int_input().abs(),
        }
    }

    pub(super) fn inputs(&self) -> Vec<f64> {
        let mut inputs = vec![0.0; StepLayout::LEN];
        inputs[StepLayout::STATE..][..3].copy_from_slice(&self.state);
        inputs[StepLayout::NEXT_STATE..][..3].copy_from_slice(&self.next_state);
        inputs[StepLayout::ACTION] = self.action as f64;
        inputs[StepLayout::REWARD] = self.reward;
        inputs[StepLayout::TERMINATED] = f64::from(u8::from(self.terminated));
        inputs[StepLayout::TRUNCATED] = f64::from(u8::from(self.truncated));
        inputs[StepLayout::STEP] = self.number as f64;
        inputs
    }
}

impl Bench {
    pub(super) fn new(text: &str) -> Self {
        Self::parse(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    fn parse(text: &str) -> Result<Self, Diagnostic> {
        let context = Context::new(SourceSet::from_text("test.rhai", text));
        let engine = engine(&context);
        let ast = compile(&engine, &context, "test.rhai", text)?;
        let mut scope = rhai::Scope::new();
        engine.run_ast_with_scope(&mut scope, &ast).unwrap();
        let constants = scope.iter().filter(|(_, is_constant, _)| *is_constant);
        let constants: std::collections::BTreeMap<String, Constant> = constants
            .map(|(name, _, value)| (name.to_string(), Constant::freeze(&value).unwrap()))
            .collect();
        let host = Callbacks::new(engine, ast, context.clone(), constants.clone());
        let function = |name: &str| host.function(name);
        *context.constants.borrow_mut() =
            constants.iter().map(|(k, v)| (k.clone(), v.thaw(&function))).collect();
        Ok(Self { host, text: text.to_string(), schema: Rc::new(schema()) })
    }

    /// The function `name` of a step, lowered.
    pub(super) fn lower(&self, name: &str, want: Want) -> Result<Program, Outside> {
        let subject = Subject {
            function: name,
            captures: &[],
            params: &[Param::Step],
            n_inputs: StepLayout::LEN,
            want,
        };
        let host = &self.host;
        let library = host.library.get_or_init(|| Library::new(&host.ast, &host.context));
        lower(&subject, library, &host.constants, &self.schema)
    }

    fn view(&self, step: &Step) -> Dynamic {
        let state = |fields: &[f64; 3]| State::new(&self.schema, fields);
        Dynamic::from(StepView {
            state: state(&step.state),
            action: step.action,
            reward: step.reward,
            next_state: state(&step.next_state),
            terminated: step.terminated,
            truncated: step.truncated,
            step: step.number,
        })
    }

    /// The text of `name` and of the functions that it may call.
    fn source(&self, name: &str) -> String {
        let helpers = format!("fn h{}_", name.trim_start_matches('p'));
        let functions = self.text.split_inclusive("\nfn ").map(|f| format!("fn {f}"));
        let own =
            functions.filter(|f| f.starts_with(&format!("fn {name}(")) || f.starts_with(&helpers));
        let own: String = own.collect();
        if own.is_empty() { self.text.clone() } else { own }
    }

    /// What the interpreter gives, and the operations that took.
    fn interpret(&self, name: &str, want: &Want, step: &Step) -> (Outcome, u64) {
        let result = self.host.call(&Prepared::named(name), [self.view(step)]);
        let operations = self.host.context.operations.get();
        let outcome = match (result, want) {
            (Err(_), _) => Outcome::Error,
            (Ok(value), Want::Number) => {
                crate::script::params::number(&value).map_or(Outcome::Error, float)
            }
            (Ok(value), Want::Flag) => value.as_bool().map_or(Outcome::Error, Outcome::Bool),
            (Ok(value), _) => value.as_int().map_or(Outcome::Error, Outcome::Int),
        };
        (outcome, operations)
    }

    /// The cell that the host makes of what the interpreter gives.
    pub(super) fn cell(&self, name: &str, shape: &[usize], step: &Step) -> Option<usize> {
        let value = self.host.call(&Prepared::named(name), [self.view(step)]).ok()?;
        cell_index(&value, shape, &Prepared::named(name).callback).ok()
    }

    /// Runs the function `name` all three ways; `None` if it is outside the subset.
    ///
    /// # Panics
    /// If they disagree.
    pub(super) fn compare(&self, name: &str, want: &Want, steps: &[Step]) -> Option<()> {
        let program = self.lower(name, want.clone()).ok()?;
        let machine = Machine::new(&program);
        for step in steps {
            let inputs = step.inputs();
            let evaluated = evaluate(&program, &inputs);
            let compiled = machine.call(&inputs);
            let (interpreted, operations) = self.interpret(name, want, step);
            let fail = |what: &str| -> ! {
                let error = self.host.call(&Prepared::named(name), [self.view(step)]).err();
                panic!(
                    "{what}: interpreted {interpreted:?} in {operations} operations, evaluated \
                     {evaluated:?}, compiled {compiled:?}\n{error:?}\n{name} on {step:?} of\n{}\n\
                     {program:#?}",
                    self.source(name)
                )
            };
            // Machine code has no way to tell these from a trap; the interpreter is asked then.
            let is_trap = |o: Outcome| match o {
                Outcome::Float(bits) => f64::from_bits(bits).is_nan(),
                Outcome::Int(x) => x == i64::MIN,
                Outcome::Bool(_) => false,
                Outcome::Error => true,
            };
            if compiled != evaluated && !(is_trap(compiled) && is_trap(evaluated)) {
                fail("machine code and evaluator differ");
            }
            // Loops are charged for more than they use: the interpreter has the last word then.
            let long = operations > CALLBACK_OPERATIONS / 20;
            if evaluated != interpreted && !(long && evaluated == Outcome::Error) {
                fail("evaluator and interpreter differ");
            }
        }
        Some(())
    }
}

fn evaluate(program: &Program, inputs: &[f64]) -> Outcome {
    match program.evaluate(inputs) {
        None => Outcome::Error,
        Some(Value::Float(x)) => float(x),
        Some(Value::Int(x)) => Outcome::Int(x),
        Some(Value::Bool(x)) => Outcome::Bool(x),
    }
}

/// Machine code of one of the two kinds.
enum Machine {
    Float(Kernel<f64>),
    Int(Kernel<i64>, bool),
}

impl Machine {
    fn new(program: &Program) -> Self {
        match program.result {
            ir::Type::Float => Self::Float(Kernel::new(program.clone()).unwrap()),
            ty => Self::Int(Kernel::new(program.clone()).unwrap(), ty == ir::Type::Bool),
        }
    }

    fn call(&self, inputs: &[f64]) -> Outcome {
        match self {
            Self::Float(kernel) => {
                let x = kernel.call(inputs);
                if x.is_nan() { Outcome::Error } else { float(x) }
            }
            Self::Int(kernel, is_flag) => match kernel.call(inputs) {
                i64::MIN => Outcome::Error,
                x if *is_flag => Outcome::Bool(x != 0),
                x => Outcome::Int(x),
            },
        }
    }
}

fn want(ty: Ty) -> Want {
    match ty {
        Ty::Float => Want::Number,
        Ty::Int => Want::Integer,
        Ty::Bool => Want::Flag,
    }
}

/// Runs `n` random programs from `seed` on. Gives how many lie in the subset.
fn differential(seed: u64, n: usize) -> usize {
    const BATCH: usize = 20;
    let mut lowered = 0;
    for batch in 0..n.div_ceil(BATCH) {
        let mut g = Generator::new(seed.wrapping_add(batch as u64));
        let (text, results) = g.script(BATCH);
        let bench = match Bench::parse(&text) {
            Ok(bench) => bench,
            // Rhai limits how deep expressions may be nested.
            Err(e) if e.message.contains("complexity") => continue,
            Err(e) => panic!("{e}\n{text}"),
        };
        for (i, ty) in results.into_iter().enumerate() {
            let steps: Vec<Step> = (0..12).map(|_| Step::random(&mut g)).collect();
            lowered += usize::from(bench.compare(&format!("p{i}"), &want(ty), &steps).is_some());
        }
    }
    lowered
}

#[test]
fn thousands_of_random_programs_agree() {
    let n = 4_000;
    let lowered = differential(1, n);
    assert!(lowered > n / 2, "only {lowered} of {n} programs lie in the subset");
}

/// `RUNNER_PROGRAMS=2000000 RUNNER_SEED=7 cargo test --release --lib millions -- --ignored
/// --nocapture`
#[test]
#[ignore = "takes minutes to hours: the number of programs is in RUNNER_PROGRAMS"]
fn millions_of_random_programs_agree() {
    let number = |name: &str, default: u64| {
        std::env::var(name).ok().and_then(|x| x.parse().ok()).unwrap_or(default)
    };
    let (n, seed) = (number("RUNNER_PROGRAMS", 1_000_000) as usize, number("RUNNER_SEED", 1 << 32));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let lowered: usize = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|k| {
                let seed = seed.wrapping_add((k as u64) << 40);
                scope.spawn(move || differential(seed, n / threads))
            })
            .collect();
        workers.into_iter().map(|w| w.join().unwrap()).sum()
    });
    assert!(lowered > n / 2, "only {lowered} of {n} programs lie in the subset");
}
