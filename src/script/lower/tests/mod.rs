//! The lowering against the interpreter: chosen programs, random ones, and what lies outside.

mod differential;
mod generator;

use differential::{Bench, Step};

use super::Want;

const NAN: f64 = f64::NAN;

/// Steps with values at the edges.
fn steps() -> Vec<Step> {
    let step = |x: f64, y: f64, n: f64, action: i64, reward: f64| Step {
        state: [x, y, n],
        next_state: [y, x, n + 1.0],
        action,
        reward,
        terminated: x > 0.0,
        truncated: action == 1,
        number: 5,
    };
    vec![
        step(0.0, -0.0, 0.0, 0, 1.0),
        step(1.5, -2.5, 3.0, 1, -1.0),
        step(-0.5, 0.5, -4.0, 2, 0.0),
        step(NAN, f64::INFINITY, 9.0, 3, f64::NEG_INFINITY),
        step(1e308, 5e-324, 1e15, -7, 9.3e18),
        step(2.0, 3.0, 2.0, 1, 0.1),
    ]
}

/// Runs the function `p` of `text` all three ways.
fn agree(text: &str, want: &Want) {
    let bench = Bench::new(text);
    if let Err(outside) = bench.lower("p", want.clone()) {
        panic!("{} at {:?}\n{text}", outside.what, outside.position);
    }
    assert!(bench.compare("p", want, &steps()).is_some());
}

#[test]
fn numbers() {
    for body in [
        "t.state.x",
        "-t.state.x ** 2",
        "t.state.n / 2 + 7 % -3",
        "1 / t.state.n",
        "1 % t.state.n",
        "t.state.n * 4611686018427387904",
        "abs(-9223372036854775807 - t.action)",
        "to_int(t.state.x) + to_int(t.reward)",
        "if t.terminated { 1 } else { 2.5 }",
        "if t.terminated { 1.0 }",
        "t.state.x % 0.3 + t.reward % 0",
        "min(t.state.x, t.state.y) - max(t.state.x, 1)",
        "clamp(t.state.x, -1, 1) + clamp(t.state.n, -2, 2)",
        "sign(t.state.x) + sign(t.state.n)",
        "(t.state.x).floor + (t.state.x).fraction + (t.state.n).abs()",
        "t.state[0] + t[\"state\"][-2] + t.next_state[-1]",
        "let a = [t.state.x, 2.0]; a[t.action - 1] + a.len()",
        "let x = 1; let x = 2.5; { let x = 7; } x",
        "let x = t.state.n; x += { x = 5; 1 }; x",
        "let x = t.state.n; x + { x = 5; x }",
        "let s = t.next_state; s.x * s[1]",
        "let sum = 0.0; for (i, k) in 2..=5 { if i == 4 { continue; } sum += i * k; } sum",
        "let n = 0; for i in 5..2 { n += 1; } for i in range(5, 0, -2) { n += i; } n",
        "let n = 0; do { n += 1; if n == 3 { continue; } } while n < 2; n",
        "let n = 0; loop { n += 1; if n > 9 { break; } } n",
        "let i = 0; while true { i += 1; if i == 7 { return i; } }",
        "switch t.action { 0 => 1.5, 1 | 2 if t.terminated => 2, 3..5 => 3, _ => 4 }",
        "let x = switch t.action { 1 => 1.0, _ => 2.0 }; x * 2",
        "if t.action == 1 { throw \"no\"; } 1.0",
        "let x = 0.5; x **= 2; x /= 0; x",
        "9223372036854775807 + t.action",
        "-(t.action - 9223372036854775807 - 1)",
        "for g in [#{ a: 1.5 }, #{ a: t.state.x }] { }",
        "PI + E - INF",
        "let f = |x| x * 2.0; 1.0",
        "1.0 ** -1 + 2 ** 62 + (t.state.x) ** 2 + t.state.x ** 0.5",
        "t.state.n == 3 || 1 / t.state.n > 0",
        "hypot(t.state.x, t.state.y) + atan(t.state.y, t.state.x) + log(8.0, 2.0)",
    ] {
        let text = format!("fn p(t) {{ {body} }}");
        let bench = Bench::new(&text);
        if bench.compare("p", &Want::Number, &steps()).is_none() {
            // Closures and arrays of maps that are made here are the only ones left out.
            assert!(body.contains('|') && body.contains("let f") || body.contains("#{"), "{body}");
        }
    }
}

#[test]
fn calls_constants_and_recursion() {
    agree(
        "const K = 2.5; const W = [[1.0, 2.0], [3.0, 4.0]];
         fn half(x) { x * 0.5 }
         fn pick(i, j) { if i > 1 { return W[0][j]; } W[i][j] }
         fn twice(x) { x += x; x }
         fn far(s) { half(s.x) - K }
         fn p(t) { let x = 1.5; far(t.next_state) + twice(x) + x + pick(t.action, 1) + pick(0, -1) }",
        &Want::Number,
    );
    agree("fn f(a) { f(a, 1) } fn f(a, b) { a - b } fn p(t) { f(t.reward) }", &Want::Number);
    // A script's own function comes before the library's.
    agree("fn abs(x) { -1.0 } fn p(t) { abs(t.reward) + t.reward.abs() }", &Want::Number);
    let bench = Bench::new("fn f(n) { if n == 0 { 1 } else { n * f(n - 1) } } fn p(t) { f(3) }");
    let outside = bench.lower("p", Want::Number).unwrap_err();
    assert_eq!(outside.what, "a function that calls itself");
}

#[test]
fn cells_and_flags() {
    for body in [
        "[to_int(t.state.x), t.action]",
        "[t.action, 2]",
        "[t.action]",
        "t.action",
        "let c = [1, t.action]; c",
        "if t.action < 2 { [0, t.action] } else { [1, 0] }",
    ] {
        let bench = Bench::new(&format!("fn p(t) {{ {body} }}"));
        let program = bench.lower("p", Want::Cell(vec![2, 3])).unwrap();
        for step in steps() {
            let cell = bench.cell("p", &[2, 3], &step);
            let evaluated = program.evaluate(&step.inputs());
            let evaluated = evaluated.map(|v| match v {
                crate::jit::Value::Int(i) => i as usize,
                other => panic!("{other:?}"),
            });
            assert_eq!(evaluated, cell, "{body} on {step:?}");
        }
    }
    agree("fn p(t) { t.state.x > 0.0 && !(t.action == 1) }", &Want::Flag);
}

/// What was found to differ once.
#[test]
fn regressions() {
    for (text, want) in [
        // A case after which nothing comes.
        ("fn p(t) { switch t.action { 1 => return 2.0, _ => 3.0 } }", Want::Number),
        // The sign of a remainder, and of zeros.
        ("fn p(t) { (-0.0 - t.state.x * 0.0) % 1.0 }", Want::Number),
    ] {
        agree(text, &want);
    }
}

#[test]
fn what_lies_outside_is_named_with_its_place() {
    for (body, what, line) in [
        ("let s = \"a\" + 1;\n1.0", "`+` of a string", 1),
        (
            "1.0;\nlet x = 0;\nx = 0.5;\nx",
            "`x`, which holds an integer first and a float later (let it start as 0.0, not 0)",
            3,
        ),
        ("let a = [1.0];\na[0] = 2.0;\n1.0", "an array in a variable that changes", 1),
        ("print(1);\n1.0", "`print`", 1),
        ("try { 1.0 } catch { 2.0 }", "`try`", 1),
        ("let m = #{ a: t.reward };\nm.a", "a map", 1),
        ("switch t.reward { 1.0 => 2.0, _ => 3.0 }", "a `switch` on a float", 1),
        ("let x;\nx = 1.0;\nx", "a variable that gets its value later", 1),
        (
            "(if t.terminated { 1 } else { 2.0 }) * 2",
            "a number of one type on one path and of \
          another on the other (write 0.0 for 0)",
            1,
        ),
    ] {
        let bench = Bench::new(&format!("fn p(t) {{ {body} }}"));
        let outside = bench.lower("p", Want::Number).unwrap_err();
        assert_eq!((outside.what.as_str(), outside.position.line()), (what, Some(line)), "{body}");
    }
}

/// Whatever machine code finishes, the interpreter finishes as well: its operations are fewer than
/// what loops are charged for.
#[test]
fn loops_are_charged_for_more_than_the_interpreter_counts() {
    for body in [
        "let x = 0.0; for i in 0..N { x += i * 0.5; } x",
        "let x = 0.0; let i = 0; while i < N { i += 1; if i % 2 == 0 { continue; } x = f(x, i); } x",
        "let n = 0; loop { n += 1; if n == N { break; } } n",
        "let n = 0; for i in 0..N { } n",
        "let n = 0; for i in 0..N { for j in [1.0, 2.0] { n += t.state.n * i; } } n",
    ] {
        for rounds in
            [10, 1_000, 20_000, 30_000, 50_000, 100_000, 150_000, 200_000, 300_000, 1 << 20]
        {
            let text = format!(
                "const N = {rounds}; fn f(x, i) {{ let y = x + i; y * 0.5 }} fn p(t) {{ {body} }}"
            );
            assert!(Bench::new(&text).compare("p", &Want::Number, &steps()[..1]).is_some());
        }
    }
}
