//! Tests of the learning-curve plot.

use super::*;
use crate::stats::curve_band;

fn plot(threshold: Option<f64>, curves: &[(&str, Vec<Vec<f64>>)]) -> CurvesPlot {
    let curves = curves
        .iter()
        .enumerate()
        .map(|(look, (name, runs))| {
            let band = band(runs);
            Curve { name: (*name).into(), look, dashed: false, band }
        })
        .collect();
    let (title, quantity) = ("a <study> & more".into(), NATIVE_RETURN);
    CurvesPlot { title, quantity, window: Some(20), threshold, curves }
}

/// Up to the end of the longest run.
fn band(runs: &[Vec<f64>]) -> CurveBand {
    curve_band(runs, 20, runs.iter().map(Vec::len).max().unwrap_or(0))
}

/// Seeds that learn a little earlier or later, from −200 towards −100.
fn learning(seeds: usize, episodes: usize) -> Vec<Vec<f64>> {
    let run = |s: usize| {
        (0..episodes).map(|e| -200.0 + 100.0 * (e as f64 / (e + 50 + 10 * s) as f64)).collect()
    };
    (0..seeds).map(run).collect()
}

fn count(svg: &str, what: &str) -> usize {
    svg.matches(what).count()
}

/// Every number in the document's attributes is finite, and every element is closed.
fn well_formed(svg: &str) {
    let numbers = svg.lines().filter(|line| !line.starts_with("<desc>"));
    for line in numbers {
        assert!(
            !line.contains("NaN") && !line.contains("inf") && !line.contains("d=\"\""),
            "{line}"
        );
    }
    let mut open = Vec::new();
    for tag in svg.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("a tag ends");
        let name = tag.split([' ', '/']).find(|s| !s.is_empty()).unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "{svg}");
        } else if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn a_study_has_its_parts() {
    let svg = curves_svg(&plot(
        Some(-110.0),
        &[("plain", learning(12, 900)), ("a\"b", learning(12, 900)[2..].to_vec())],
    ));
    well_formed(&svg);
    assert!(svg.contains("<title>a &lt;study&gt; &amp; more</title>"));
    assert!(svg.contains("10 to 12 seeds, rolling mean over 20 episodes, band: 95 % interval"));
    assert!(svg.contains("a&quot;b") && svg.contains(">solved at \u{2212}110</text>"));
    for part in ["episode", "native return", "IQM over seeds", "mean over seeds"] {
        assert!(svg.contains(&format!(">{part}</text>")), "{part}");
    }
    // Two bands; two thick lines, their two samples and the key's.
    assert_eq!(count(&svg, "fill-opacity=\"0.22\"/>"), 2 + 1);
    assert_eq!(count(&svg, "stroke-width=\"2.2\""), 2 + 2 + 1);
    // A background of its own: a dark page must not show through.
    assert!(svg.contains("fill=\"#fff\"/>"));
}

#[test]
fn bytes_repeat_and_stay_few() {
    let names: Vec<String> = (0..30).map(|i| format!("alpha={i}")).collect();
    let curves: Vec<(&str, Vec<Vec<f64>>)> =
        names.iter().map(|n| (n.as_str(), learning(6, 1000))).collect();
    let plot = plot(Some(-110.0), &curves);
    let svg = curves_svg(&plot);
    assert_eq!(svg, curves_svg(&plot));
    assert!(svg.len() < 300_000, "{}", svg.len());
    well_formed(&svg);
}

#[test]
fn one_seed_has_no_band_and_says_so() {
    let svg = curves_svg(&plot(None, &[("plain", learning(1, 100))]));
    well_formed(&svg);
    assert_eq!(count(&svg, "fill-opacity"), 0);
    assert!(svg.contains("1 seed, rolling mean over 20 episodes, no band"));
}

#[test]
fn stopped_seeds_are_carried_forward_and_the_plot_says_so() {
    let mut runs = learning(5, 400);
    let whole = curves_svg(&plot(None, &[("plain", runs.clone())]));
    assert!(!whole.contains("stopped") && !whole.contains("carried"));
    runs[1].truncate(150);
    runs[3].truncate(200);
    let svg = curves_svg(&plot(None, &[("plain", runs)]));
    well_formed(&svg);
    assert!(svg.contains("interval of the IQM, stopped seeds carried forward</text>"), "{svg}");
    assert!(svg.contains(" after 400 episodes, 2 of 5 seeds stopped before and carried forward."));
}

#[test]
fn odd_curves_are_drawn_all_the_same() {
    let broken = vec![(0..90).map(|e| if e / 30 == 1 { f64::NAN } else { 1.0 }).collect(); 3];
    let diverged = vec![vec![f64::NEG_INFINITY; 50]; 3];
    for runs in
        [vec![vec![-200.0; 50]; 5], vec![vec![3.0]; 5], vec![], vec![vec![]; 4], broken, diverged]
    {
        well_formed(&curves_svg(&plot(Some(1.0), &[("odd", runs.clone())])));
        well_formed(&curves_svg(&plot(None, &[("odd", runs), ("plain", learning(5, 60))])));
    }
    well_formed(&curves_svg(&plot(None, &[])));
    let huge = vec![vec![-1e300; 40], vec![1e300; 40], vec![1e308; 40]];
    well_formed(&curves_svg(&plot(Some(0.0), &[("huge", huge)])));
}

#[test]
fn a_gap_breaks_the_line() {
    let band = CurveBand {
        episode: vec![1, 2, 3, 4, 5],
        mean: vec![1.0; 5],
        iqm: vec![0.0, 1.0, f64::NAN, 1.0, 2.0],
        low: vec![0.0; 5],
        high: vec![1.0; 5],
        seeds: 1,
        carried: 0,
        method: None,
    };
    let scale = Scale { low: 0.0, high: 10.0, from: 0.0, to: 10.0 };
    assert_eq!(line(&band, &band.iqm, &[0, 1, 2, 3, 4], scale, scale), "M1,0 2,1M4,1 5,2");
    assert_eq!(area(&band, &[0, 1], scale, scale), "M1,1 2,1L2,0 1,0Z");
}

#[test]
fn a_far_threshold_and_an_early_plunge_do_not_flatten_the_curves() {
    let far = plot(Some(9000.0), &[("plain", learning(5, 400))]);
    let (low, high, remark) = value_range(&far);
    assert!(low > -250.0 && high < -50.0 && remark.is_none());
    assert!(curves_svg(&far).contains("solved at 9000: above"));

    let cliff =
        vec![
            (0..400).map(|e| if e < 20 { -7000.0 } else { -60.0 + f64::from(e) / 10.0 }).collect();
            5
        ];
    let cliff = plot(None, &[("sarsa", cliff)]);
    let (low, _, remark) = value_range(&cliff);
    assert!(low > -100.0, "{low}");
    assert!(remark.unwrap().contains("reach from \u{2212}7000"));
}

#[test]
fn near_thresholds_are_in_view() {
    let near = plot(Some(-80.0), &[("plain", learning(5, 400))]);
    assert!(value_range(&near).1 > -80.0);
}

#[test]
fn fifty_variants_look_different() {
    let looks: std::collections::BTreeSet<_> =
        (0..56).map(|i| (colour(i), MARKERS[i % MARKERS.len()])).collect();
    assert_eq!(looks.len(), 56);
}
