//! The machine code of callbacks does nothing needless.

use super::programs::{cells, height, one_line, quadratic, reward};
use super::*;
use crate::jit::machine::listing;

/// How many instructions of `program` contain one of `words`.
fn count(program: &Program, words: &[&str]) -> usize {
    listing(program).lines().filter(|line| words.iter().any(|w| line.contains(w))).count()
}

/// An input is loaded once, and a quotient that is squared is computed once.
#[test]
fn nothing_is_done_twice() {
    assert_eq!(count(&quadratic(), &["divsd"]), 2, "{}", listing(&quadratic()));
    assert_eq!(count(&quadratic(), &["(%rdi)"]), 2, "{}", listing(&quadratic()));
    assert_eq!(count(&reward(), &["(%rdi)"]), 2, "{}", listing(&reward()));
    assert_eq!(count(&cells(), &["(%rdi)"]), 4, "{}", listing(&cells()));
}

/// Bins are bounded, and so is what is made of them: overflow needs no check.
#[test]
fn bounded_integers_are_not_checked() {
    assert_eq!(count(&cells(), &["seto", "jo", "jnz"]), 0, "{}", listing(&cells()));
    assert_eq!(count(&cells(), &["roundsd"]), 4, "{}", listing(&cells()));
    let sum = binary(Binary::AddInt, Expr::Input(0, Type::Int), Expr::Int(1));
    let checked = program(1, Type::Int, vec![Stmt::Return(sum)]);
    assert_eq!(count(&checked, &["seto"]), 1, "{}", listing(&checked));
}

/// One branch for the early return; what is cheap is chosen without.
#[test]
fn cheap_choices_do_not_branch() {
    assert_eq!(count(&reward(), &["  j"]), 1, "{}", listing(&reward()));
    assert_eq!(count(&reward(), &["cmov"]), 1, "{}", listing(&reward()));
    for program in [one_line(), quadratic(), height()] {
        assert_eq!(count(&program, &["  j"]), 0, "{}", listing(&program));
    }
}

/// Rounding, the lesser and the greater are instructions.
#[test]
fn operations_are_instructions() {
    assert_eq!(count(&cells(), &["call"]), 0, "{}", listing(&cells()));
    assert_eq!(count(&cells(), &["maxsd"]), 4, "{}", listing(&cells()));
    assert_eq!(count(&cells(), &["minsd"]), 4, "{}", listing(&cells()));
    assert_eq!(count(&height(), &["call"]), 1, "{}", listing(&height()));
}
