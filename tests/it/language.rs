//! What the script language means: each test runs its functions while the plan is built and again
//! as a callback on another engine, and expects the same.

use std::collections::BTreeMap;
use std::path::Path;

use runner::script::{Callback, DiscretiserSpec, Host, Plan, Variant, load};

/// Loads `script` from a folder with the files it imports.
pub(crate) fn plan_of(script: &str, files: &[(&str, &str)]) -> Plan {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files.iter().chain(&[("script.rhai", script)]) {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    load(&folder.path().join("script.rhai")).unwrap_or_else(|d| panic!("{script}\n{d}"))
}

pub(crate) fn potential(variant: &Variant) -> &Callback {
    variant.potential.as_ref().expect("a potential")
}

/// Φ of the only variant in FrozenLake's state at `row`, `col`, called on a fresh engine.
fn phi_at(plan: &Plan, variant: usize, row: u8, col: u8) -> f64 {
    let variant = &plan.variants[variant];
    let host = Host::open(plan).unwrap();
    let schema = variant.environment().unwrap().schema();
    let mut phi = host.callbacks().potential(potential(variant), &schema);
    let (row, col) = (f64::from(row), f64::from(col));
    let first = phi
        .at(&[row, col, 4.0 * row + col, f64::from(b'F')], 1)
        .unwrap_or_else(|e| panic!("{e:?}"));
    let again = phi.at(&[row, col, 4.0 * row + col, f64::from(b'F')], 1).unwrap();
    assert_eq!(first.to_bits(), again.to_bits(), "a callback keeps nothing from call to call");
    first
}

pub(crate) const LAKE: &str =
    "experiment(#{ env: \"FrozenLake-v1\", agent: q_learning(), potential: f })";

/// The value of `body` as the body of a function, while the plan is built and in a callback.
pub(crate) fn value(head: &str, body: &str) -> f64 {
    let plan = plan_of(&format!("{head}\nfn f(s) {{ {body} }}\nprint(f(0));\n{LAKE}"), &[]);
    let later = phi_at(&plan, 0, 1, 2);
    let now: f64 = plan.printed[0].parse().unwrap();
    assert_eq!(now.to_bits(), later.to_bits(), "{head} {body}: {now} first, {later} later");
    later
}

pub(crate) fn holds(condition: &str) -> bool {
    value("", &format!("if {condition} {{ 1 }} else {{ 0 }}")) == 1.0
}

/// The value of `body` on the state in row 1, column 2.
fn on_state(head: &str, body: &str) -> f64 {
    phi_at(&plan_of(&format!("{head}\nfn f(s) {{ {body} }}\n{LAKE}"), &[]), 0, 1, 2)
}

#[test]
fn functions_see_constants_wherever_they_are_defined() {
    assert_eq!(value("const K = 2.5;", "K * 2"), 5.0);
    assert_eq!(value("const K = 2; const L = K * 3;", "L"), 6.0);
    assert_eq!(value("const T = [1, [2, 3]]; const M = #{ a: 4 };", "T[1][1] + M.a"), 7.0);
    assert_eq!(value("const K = 3; const G = |x| x * K;", "G.call(2)"), 6.0);
    assert_eq!(value("fn g() { K } const K = 2;", "g()"), 2.0);
    // Only called once the plan is there.
    let plan = plan_of(
        "fn f(s) { LATE } let e = 1; const LATE = 9; let x = experiment(#{ env: \"FrozenLake-v1\", agent: q_learning(), potential: f }); x",
        &[],
    );
    assert_eq!(phi_at(&plan, 0, 0, 0), 9.0);
    // Parameters and locals hide them.
    assert_eq!(value("const K = 1; fn g(K) { K }", "g(5)"), 5.0);
    assert_eq!(value("const K = 1;", "let K = 7; K"), 7.0);
}

#[test]
fn built_in_constants_yield_to_the_scripts_own() {
    assert_eq!(value("", "PI"), std::f64::consts::PI);
    assert_eq!(value("", "E"), std::f64::consts::E);
    assert!(holds("INF > 1e308"));
    assert_eq!(value("const PI = 3;", "PI"), 3.0);
    assert_eq!(value("const E = 0.5; fn g(x) { E * x }", "g(4)"), 2.0);
    assert_eq!(value("", "let INF = 2; INF"), 2.0);
}

#[test]
fn functions_may_be_named_before_they_are_defined() {
    let script = "let e = experiment(#{ env: \"FrozenLake-v1\", agent: q_learning(), potential: f }); fn f(s) { g(s) + 1 } fn g(s) { s.row } e";
    assert_eq!(phi_at(&plan_of(script, &[]), 0, 3, 0), 4.0);
}

#[test]
fn closures_keep_what_they_captured_when_they_were_handed_over() {
    let plan = plan_of(
        "let base = experiment(#{ env: \"FrozenLake-v1\", agent: q_learning() });
        let all = [];
        for k in 1..4 { all.push(base.with(#{ name: `k-${k}`, potential: |s| k * s.row })); }
        let scale = 10;
        let g = |x| scale * x;
        all.push(base.with(#{ name: \"inner\", potential: |s| g.call(s.row) }));
        scale = 100;
        let table = [5, 6, 7, 8];
        all.push(base.with(#{ name: \"table\", potential: |s| { table[0] += 1; table[s.row] + table[0] } }));
        all",
        &[],
    );
    let at_two: Vec<f64> = (0..5).map(|i| phi_at(&plan, i, 2, 0)).collect();
    assert_eq!(at_two, [2.0, 4.0, 6.0, 20.0, 13.0]);
}

#[test]
fn imports_serve_function_bodies_and_closures() {
    let files = [
        (
            "lib/shapes.rhai",
            "import \"deep/units\" as units;\nconst SCALE = 2;\nfn distance(s) { SCALE * (s.row + s.col) * one() }\nfn one() { 1 }\nfn far(s) { units::mile() * distance(s) }",
        ),
        ("lib/deep/units.rhai", "const MILE = 1.5;\nfn mile() { MILE }\nfn pi() { PI }"),
    ];
    let script = "import \"lib/shapes\" as shapes;
        import \"lib/deep/units\" as units;
        fn f(s) { shapes::distance(s) }
        let e = experiment(#{ env: \"FrozenLake-v1\", agent: q_learning(), potential: f });
        let k = 3;
        [e, e.with(#{ name: \"b\", potential: |s| k * shapes::far(s) }), e.with(#{ name: \"c\", potential: |s| units::pi() })]";
    let plan = plan_of(script, &files);
    assert_eq!(plan.sources.imports.len(), 2);
    assert_eq!(phi_at(&plan, 0, 1, 2), 6.0);
    assert_eq!(phi_at(&plan, 1, 1, 2), 27.0);
    assert_eq!(phi_at(&plan, 2, 1, 2), std::f64::consts::PI);
}

#[test]
fn with_merges_deeply_and_unit_removes() {
    let plan = plan_of(
        "let base = experiment(#{
            env: env(\"FrozenLake-v1\", #{ map_name: \"8x8\", is_slippery: false }),
            agent: q_learning(#{ alpha: 0.5, gamma: 0.9 }),
            terms: #{ a: |t| 1, b: |t| 2 },
            potential: |s| 1, threshold: 3,
        });
        [base, base.with(#{ name: \"other\", env: #{ is_slippery: (), map_name: \"4x4\" },
            agent: #{ alpha: 1 }, terms: #{ a: (), c: |t| 3 }, potential: (), threshold: () })]",
        &[],
    );
    let [base, other] = plan.variants.as_slice() else { panic!() };
    assert_eq!(
        (&base.config.kwargs["map_name"], &base.config.kwargs["is_slippery"]),
        (&"8x8".into(), &false.into())
    );
    assert_eq!(
        (&other.config.kwargs["map_name"], &other.config.kwargs["is_slippery"]),
        (&"4x4".into(), &true.into())
    );
    assert_eq!((other.agent.float("gamma"), base.agent.float("gamma")), (0.9, 0.9));
    assert_eq!(other.agent.params["alpha"].to_string(), "1.0");
    assert_eq!(base.agent.params["alpha"].to_string(), "0.5");
    assert_eq!(other.terms.keys().collect::<Vec<_>>(), ["b", "c"]);
    assert!(other.potential.is_none() && base.potential.is_some());
    assert_eq!((base.threshold, other.threshold), (Some(3.0), other.env.reward_threshold));
}

#[test]
fn schedules_and_discretisers_as_written() {
    let plan = plan_of(
        "let m = experiment(#{ env: \"MountainCar-v0\", agent: q_learning(#{ epsilon: linear(1, 0.1, 50, #{ steps: true }), alpha: exponential(1, 0.5, 0.1) }),
            discretiser: bins(#{ velocity: [-0.07, 0.07, 4], position: [-1.2, 1, 3] }) });
        [m, m.with(#{ name: \"array\", discretiser: bins([[-1.2, 1, 3], [-0.07, 0.07, 4]]) }),
            m.with(#{ name: \"n\", discretiser: cells(5, |s| 4) }),
            m.with(#{ name: \"nm\", discretiser: cells([2, 3], |s| [1, 2]) })]",
        &[],
    );
    let params = &plan.variants[0].agent.params;
    assert_eq!(params["epsilon"].to_string(), "linear(1.0, 0.1, 50, #{ steps: true })");
    assert_eq!(params["alpha"].to_string(), "exponential(1.0, 0.5, 0.1)");
    let bins = |i: usize| match &plan.variants[i].discretiser {
        DiscretiserSpec::Bins(dims) => {
            dims.iter().map(|d| (d.field, d.lo, d.hi, d.n)).collect::<Vec<_>>()
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(bins(0), [(0, -1.2, 1.0, 3), (1, -0.07, 0.07, 4)], "in the order of the fields");
    assert_eq!(bins(0), bins(1));
    let host = Host::open(&plan).unwrap();
    for (i, expected) in [(2, 4), (3, 5)] {
        let variant = &plan.variants[i];
        let DiscretiserSpec::Cells { shape, cell } = &variant.discretiser else { panic!() };
        let schema = variant.environment().unwrap().schema();
        let mut cells = host.callbacks().cells(cell, shape, &[], &schema);
        assert_eq!(cells.at(&[0.0, 0.0]).unwrap(), expected);
    }
}

#[test]
fn states_have_names_indices_and_facts() {
    let cases = [
        ("s.row", 1.0),
        ("s.col", 2.0),
        ("s.index", 6.0),
        ("s[0]", 1.0),
        ("s[1]", 2.0),
        ("s[-3]", 2.0),
        ("s[\"row\"]", 1.0),
        ("s.rows", 4.0),
        ("s.cols", 4.0),
        ("s.goal_row", 3.0),
        ("s.goal_col", 3.0),
        ("s.len()", 4.0),
        ("s.row / 2", 0.0),
        ("if s.tile == \"F\" { 1 } else { 0 }", 1.0),
        ("abs(s.row - s.goal_row) + abs(s.col - s.goal_col)", 3.0),
    ];
    for (body, expected) in cases {
        assert_eq!(on_state("", body), expected, "{body}");
    }
}

/// The digest of the only variant's potential.
fn digest(script: &str, files: &[(&str, &str)]) -> String {
    potential(&plan_of(script, files).variants[0]).digest.clone()
}

#[test]
fn digests_follow_the_meaning_not_the_form() {
    let closure = |head: &str, body: &str, tail: &str| {
        digest(
            &format!(
                "{head}\nlet k = 2;\nlet e = experiment(#{{ env: \"FrozenLake-v1\", agent: q_learning(), potential: {body} }});\n{tail}\ne"
            ),
            &[],
        )
    };
    let head =
        "const K = 3; const UNUSED = 1; fn g(s) { h(s) + K } fn h(s) { s.row } fn other() { 1 }";
    let base = closure(head, "|s| k * g(s)", "");
    assert_eq!(base, closure(head, "|s|k*g(s)  /* the same */", ""));
    assert_eq!(
        base,
        closure(&format!("// About K.\n{head}"), "|s| k * g(s) // so\n", "let more = |x| x;")
    );
    assert_eq!(
        base,
        closure(&head.replace("fn other() { 1 }", "fn other() { 2 }"), "|s| k * g(s)", "")
    );
    assert_eq!(base, closure(&head.replace("UNUSED = 1", "UNUSED = 2"), "|s| k * g(s)", ""));
    let changed = [
        closure(head, "|s| k * g(s) + 0", ""),
        closure(&head.replace("K = 3", "K = 3.0"), "|s| k * g(s)", ""),
        closure(&head.replace("s.row", "s.col"), "|s| k * g(s)", ""),
        closure(head, "|s| 2 * g(s)", ""),
        closure(head, "|s| { k * g(s) }", ""),
    ];
    let capture = |k: &str| {
        digest(
            &format!(
                "let k = {k}; experiment(#{{ env: \"FrozenLake-v1\", agent: q_learning(), potential: |s| k * s.row }})"
            ),
            &[],
        )
    };
    assert_ne!(capture("2"), capture("3"));
    assert_ne!(capture("0.0"), capture("-0.0"));
    let mut all: Vec<&String> = changed.iter().chain([&base]).collect();
    all.sort();
    all.dedup();
    assert_eq!(all.len(), changed.len() + 1, "every change shows");
    let imported = |text: &str| {
        digest(
            "import \"lib\" as lib; experiment(#{ env: \"FrozenLake-v1\", agent: q_learning(), potential: |s| lib::f(s) })",
            &[("lib.rhai", text)],
        )
    };
    assert_eq!(imported("fn f(s) { s.row }"), imported("fn f(s) {\n  s.row // row\n}"));
    assert_ne!(imported("fn f(s) { s.row }"), imported("fn f(s) { s.col }"));
}

#[test]
fn overloads_and_interpolated_calls_reach_the_digest() {
    let of = |helper: &str| {
        digest(
            &format!(
                "fn g(a) {{ {helper} }} experiment(#{{ env: \"FrozenLake-v1\", agent: q_learning(), potential: |s| `${{g(s.row)}}`.len() }})"
            ),
            &[],
        )
    };
    assert_ne!(of("a"), of("a * 100"));
    let by_name = |helper: &str| {
        digest(
            &format!(
                "fn g(a) {{ {helper} }} experiment(#{{ env: \"FrozenLake-v1\", agent: q_learning(), potential: |s| Fn(\"g\").call(s.row) }})"
            ),
            &[],
        )
    };
    assert_ne!(by_name("a"), by_name("a * 100"));
}

#[test]
fn printing_is_collected_and_names_of_closures_hidden() {
    let plan = plan_of(
        "print(\"hello\"); print(1.5); debug(2); let f = |x| x; print(f); print(`${f}`); print(f.name); print([f]);
        print(get_fn_metadata_list()); fn g(s) { 1 }
        experiment(#{ env: \"FrozenLake-v1\", agent: q_learning() })",
        &[],
    );
    assert_eq!(plan.printed[..2], ["hello", "1.5"]);
    for line in &plan.printed {
        assert!(!line.contains("anon$"), "{line}");
    }
}

#[test]
fn plans_are_the_same_on_every_thread() {
    let loaded = || {
        let plan = load(Path::new("scripts/mountain_car.rhai")).unwrap();
        plan.variants
            .iter()
            .map(|v| (v.name.clone(), v.identity().to_string()))
            .collect::<BTreeMap<_, _>>()
    };
    let here = loaded();
    assert!(here.len() > 1);
    let there = std::thread::spawn(loaded).join().unwrap();
    assert_eq!(here, there);
}

#[test]
fn constants_may_hold_functions_that_use_them() {
    let recursive = "const G = g; fn g(n) { if n > 0 { G.call(n - 1) + 1 } else { 0 } }";
    assert_eq!(value(recursive, "G.call(3)"), 3.0);
    let of = |step: &str| {
        let head = recursive.replace("+ 1", step);
        digest(&format!("{head} fn f(s) {{ G.call(s.row) }} {LAKE}"), &[])
    };
    assert_eq!(of("+ 1"), of("+  1"));
    assert_ne!(of("+ 1"), of("+ 2"));
}

#[test]
fn typed_methods_reach_the_digest() {
    let of = |body: &str| {
        digest(&format!("fn int.twice() {{ {body} }} fn f(s) {{ s.row.twice() }} {LAKE}"), &[])
    };
    assert_ne!(of("this * 2"), of("this + this"));
    assert_eq!(on_state("fn int.twice() { this * 2 }", "s.row.twice()"), 2.0);
}

#[test]
fn an_import_without_a_name_only_runs() {
    let script = format!("import \"lib\"; fn f(s) {{ s.row }} {LAKE}");
    let plan = plan_of(&script, &[("lib.rhai", "print(\"here\"); 1")]);
    assert_eq!((phi_at(&plan, 0, 2, 0), plan.printed), (2.0, vec!["here".to_string()]));
}
