//! The memory of machine code, and threads in it.

use super::programs::{cells, height, quadratic};
use super::*;

/// Threads call the same code at once, and others make and drop code meanwhile.
#[test]
fn threads_share_it() {
    let kernel = Kernel::<f64>::new(height()).unwrap();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let kernel = &kernel;
            scope.spawn(move || {
                for i in 0..2_000 {
                    let x = f64::from(i + 2_000 * thread) * 1e-3;
                    let right = crate::mdp::math::sin(3.0 * x) * 0.45 + 0.55;
                    assert_eq!(kernel.call(&[x, 0.0]), right);
                    if i % 100 == 0 {
                        let own = Kernel::<i64>::new(cells()).unwrap();
                        assert_eq!(
                            own.call(&[-9.0, -9.0, -9.0, f64::from(i % 1000) - 9.0]) % 24,
                            { if i % 1000 == 0 { 0 } else { 23 } }
                        );
                    }
                }
            });
        }
    });
}

/// Code may outlive the thread that made it, and be moved.
#[test]
fn it_moves_between_threads() {
    let kernel = std::thread::spawn(|| Kernel::<f64>::new(quadratic()).unwrap()).join().unwrap();
    let boxed = Box::new(kernel);
    assert_eq!(boxed.call(&[2.4, 0.0, 0.2095, 0.0]), -1.0 - 0.1);
}

/// A table of its own, the largest part of the memory of its code.
#[cfg(all(feature = "jit", target_os = "linux"))]
fn with_table(len: usize) -> Program {
    let value = Expr::Table(0, Box::new(Expr::Input(0, Type::Int)));
    let list: Vec<f64> = (0..len).map(|i| i as f64).collect();
    Program {
        tables: vec![Table::Float(list)],
        ..program(1, Type::Float, vec![Stmt::Return(value)])
    }
}

#[cfg(all(feature = "jit", target_os = "linux"))]
#[test]
fn it_is_freed_with_its_owner() {
    use crate::jit::machine::Code;
    // Bytes of code that are of no file: each piece of code takes at least a page.
    let executable = || {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let mut bytes = 0;
        for line in maps.lines().filter(|l| l.contains(" r-xp ")) {
            let mut words = line.split_whitespace();
            let (from, to) = words.next().unwrap().split_once('-').unwrap();
            if words.count() == 4 {
                let address = |x| usize::from_str_radix(x, 16).unwrap();
                bytes += address(to) - address(from);
            }
        }
        bytes
    };
    let resident = || {
        let pages = std::fs::read_to_string("/proc/self/statm").unwrap();
        pages.split(' ').nth(1).unwrap().parse::<usize>().unwrap() * 4096
    };
    let program = with_table(10_000);
    let round = || {
        let code = Code::<f64>::new(&program).unwrap();
        assert_eq!(code.call(&[-1.0]), 9999.0);
        assert!(code.call(&[10_000.0]).is_nan());
    };
    (0..100).for_each(|_| round());
    let before = (resident(), executable());
    (0..2_000).for_each(|_| round());
    // Other tests come and go meanwhile. Leaked, they would be 160 MB of tables, 8 MB of code.
    let (tables, code) =
        (resident().saturating_sub(before.0), executable().saturating_sub(before.1));
    assert!(tables < 100 << 20, "{tables} bytes more");
    assert!(code < 2 << 20, "{code} bytes of code more");
}
