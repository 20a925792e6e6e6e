//! What a table of action values looks like over two of the state's numbers: the value, the
//! potential, the greedy action.
//!
//! A learner that is shaped by a potential learns `Q_F = Q − Φ` (Wiewiora 2003; with Ng, Harada &
//! Russell 1999 for the fixed point). What is pictured as the value of such a variant is therefore
//! `max Q_F + Φ`: an estimate of the value that the unshaped problem has, and comparable with
//! pictures of unshaped variants.

use serde_json::{Value, json};

use super::frame::{Axis, Frame, Request, frames};
use super::stored::StoredError;
use crate::experiment::{Landscape, Learned, Values};
use crate::learn::{argmax_tol, tied};
use crate::mdp::{Action, Grid};
use crate::script::{Host, Variant};
use crate::shaping::{ActionSet, Features};

/// What is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// `max Q`, or a given policy's V, with Φ added back where the learner was shaped.
    Value,
    /// The greedy action.
    Policy,
    /// Φ.
    Potential,
}

impl Quantity {
    /// The word used in files and options.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Value => "value",
            Self::Policy => "policy",
            Self::Potential => "potential",
        }
    }
}

/// What a place of a picture holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// No state in which an episode can be and act: beyond the map, or terminal.
    Nothing,
    /// A state in which nothing was learned: its values are the initial ones.
    Unknown,
    /// A value, or the number of an action.
    Known(f64),
}

impl Place {
    /// The number, if there is one.
    pub fn known(self) -> Option<f64> {
        match self {
            Self::Known(x) => Some(x),
            Self::Nothing | Self::Unknown => None,
        }
    }
}

/// A grid world's look: a letter and the arrows of the greedy actions per place.
#[derive(Debug, Clone, PartialEq)]
pub struct Tiles {
    /// The map's letters, row by row from the top.
    pub letters: Vec<char>,
    /// The greedy actions' arrows.
    pub arrows: Vec<String>,
}

/// A quantity over two fields of the state.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// The variant's name.
    pub variant: String,
    /// Whose numbers these are: `seed 0`, or `mean over 20 seeds`.
    pub seeds: String,
    /// What is shown.
    pub quantity: Quantity,
    /// What is shown, for the reader.
    pub label: String,
    /// The values at which the other fields stand.
    pub at: Vec<(String, f64)>,
    /// The axis across.
    pub x: Axis,
    /// The axis along the page.
    pub y: Axis,
    /// What is there, `[y.n][x.n]`, in ascending order of both fields.
    pub places: Vec<Place>,
    /// What the actions are called.
    pub actions: Vec<String>,
    /// The map, for grid worlds.
    pub tiles: Option<Tiles>,
}

/// The tables to be pictured.
#[derive(Debug)]
pub struct Tables {
    /// One per seed, of one shape.
    pub learned: Vec<Learned>,
    /// The seeds.
    pub seeds: Vec<u64>,
}

impl Tables {
    /// The last episode of training: one for each seed where Φ changes with the episode and they
    /// stopped at different ones, else one for all.
    fn ends(&self, variant: &Variant) -> Vec<u32> {
        let mut ends: Vec<u32> = self.learned.iter().map(|one| one.episodes).collect();
        if !variant.is_dynamic() || ends.windows(2).all(|two| two[0] == two[1]) {
            ends.truncate(1);
        }
        ends
    }

    /// Whose numbers a picture shows; `ends` are those of [`Self::ends`].
    fn whose(&self, quantity: Quantity, ends: &[u32]) -> String {
        match (self.seeds.as_slice(), quantity) {
            (_, Quantity::Potential) if ends.len() == 1 => "the same for every seed".into(),
            (seeds, Quantity::Potential) => {
                format!("mean over {} seeds, of each when it stopped", seeds.len())
            }
            ([seed], _) => format!("seed {seed}"),
            (seeds, Quantity::Value) => format!("mean over {} seeds", seeds.len()),
            (seeds, Quantity::Policy) => format!("what most of {} seeds do", seeds.len()),
        }
    }

    /// Of weights of `features`: tables with a row for each place of `frame`, in the order in which
    /// these are drawn.
    fn at_places(&self, features: &Features, frame: &Frame) -> Self {
        let places = (0..frame.y.n).flat_map(|j| (0..frame.x.n).map(move |i| (i, j)));
        let states: Vec<Vec<f64>> = places.map(|(i, j)| frame.fields(i, j)).collect();
        let learned = self.learned.iter().map(|one| one.clone().at(features, &states));
        Self { learned: learned.collect(), seeds: self.seeds.clone() }
    }

    /// As a shield leaves them.
    fn behind(&self, allowed: &[ActionSet]) -> Self {
        let learned = self.learned.iter().map(|one| one.clone().behind(allowed));
        Self { learned: learned.collect(), seeds: self.seeds.clone() }
    }

    /// The mean over the seeds that know a cell of their largest value there.
    fn value(&self, cell: usize) -> Option<f64> {
        let own = self.learned.iter().filter(|l| l.experienced[cell]);
        let (n, sum) = own.fold((0u32, 0.0), |(n, sum), l| (n + 1, sum + l.values.of(cell)));
        (n > 0).then(|| sum / f64::from(n))
    }

    /// Φ of a cell: `phi` has none, one for all seeds or one for each, of which the mean over the
    /// seeds that know the cell is taken, as of their values.
    fn potential(&self, cell: usize, phi: &[f64]) -> Option<f64> {
        if phi.len() < 2 {
            return phi.first().copied();
        }
        let own = self.learned.iter().zip(phi).filter(|(l, _)| l.experienced[cell]);
        let (n, sum) = own.fold((0u32, 0.0), |(n, sum), (_, phi)| (n + 1, sum + phi));
        (n > 0).then(|| sum / f64::from(n))
    }

    /// The action that most of the seeds that know a cell take there; the first of several.
    fn action(&self, cell: usize) -> Option<Action> {
        let n_actions = self.learned.first()?.values.q()?.n_actions();
        let mut votes = vec![0u32; n_actions];
        for l in self.learned.iter().filter(|l| l.experienced[cell]) {
            votes[argmax_tol(l.values.q()?.row(cell))] += 1;
        }
        let most = *votes.iter().max()?;
        if most == 0 { None } else { votes.iter().position(|&v| v == most) }
    }

    /// All greedy actions of a cell, by the tolerance with which they are played; of several seeds
    /// the one that most take.
    fn actions(&self, cell: usize) -> Vec<Action> {
        match self.learned.as_slice() {
            [Learned { values: Values::Q(q), experienced, .. }] if experienced[cell] => {
                tied(q.row(cell))
            }
            _ => self.action(cell).into_iter().collect(),
        }
    }
}

/// The pictures of a variant's tables: one per quantity and slice.
///
/// # Errors
/// If `request` names a field that there is not, or one without a finite range as an axis, and if
/// a callback fails.
pub fn pictures(
    host: &Host,
    variant: &Variant,
    tables: &Tables,
    request: &Request,
    quantities: &[Quantity],
) -> Result<Vec<Picture>, StoredError> {
    let mut landscape = Landscape::new(host, variant)?;
    let behind = landscape.allowed().map(|allowed| tables.behind(&allowed));
    let tables = behind.as_ref().unwrap_or(tables);
    let mut pictures = Vec::new();
    let n_cells = tables.learned.first().map_or(0, |one| one.experienced.len());
    let mut learned: Vec<usize> =
        (0..n_cells).filter(|&c| tables.learned.iter().any(|one| one.experienced[c])).collect();
    if landscape.features.is_some() {
        // Rows are features, which stand nowhere.
        learned.clear();
    }
    let features = landscape.features.clone();
    let own = variant.shaping.learned.unwrap_or(0.0);
    let has_potential = has_potential(variant);
    let ends = tables.ends(variant);
    for frame in frames(&landscape, variant, request, &learned)? {
        let cells = spots(&mut landscape, &frame, &ends)?;
        let at_places = features.as_ref().map(|features| tables.at_places(features, &frame));
        let tables = at_places.as_ref().unwrap_or(tables);
        for &quantity in quantities {
            if quantity == Quantity::Potential && !has_potential {
                continue;
            }
            // A predictor was given its policy.
            if quantity == Quantity::Policy && variant.agent.is_predictor() {
                continue;
            }
            // A map of values has the arrows in it.
            if quantity == Quantity::Policy && frame.is_map && quantities.contains(&Quantity::Value)
            {
                continue;
            }
            let of = |spot: &Spot| match spot {
                None => Place::Nothing,
                Some((cell, phi)) => {
                    let value = tables.value(*cell);
                    let phi = tables.potential(*cell, phi);
                    let phi =
                        if own == 0.0 { phi } else { value.map(|v| phi.unwrap_or(0.0) + own * v) };
                    let known = match quantity {
                        Quantity::Value => value.map(|v| v + phi.unwrap_or(0.0)),
                        Quantity::Policy => tables.action(*cell).map(|a| a as f64),
                        Quantity::Potential => phi,
                    };
                    known.map_or(Place::Unknown, Place::Known)
                }
            };
            let grid = landscape.schema.grid.as_ref().filter(|_| frame.is_map);
            pictures.push(Picture {
                variant: variant.name.clone(),
                seeds: tables.whose(quantity, &ends),
                quantity,
                label: label(variant, quantity),
                at: frame.at.clone(),
                x: frame.x.clone(),
                y: frame.y.clone(),
                places: cells.iter().map(of).collect(),
                actions: landscape.schema.actions.clone(),
                tiles: grid.map(|grid| tiles(grid, &cells, tables, quantity)),
            });
        }
    }
    Ok(pictures)
}

/// The row of the table at a place, and Φ there at each end of training, if there is one; `None` where no episode can be and act. Without a
/// table the place's own number stands for the row (see [`Tables::at_places`]).
type Spot = Option<(usize, Vec<f64>)>;

fn spots(landscape: &mut Landscape, frame: &Frame, ends: &[u32]) -> Result<Vec<Spot>, StoredError> {
    let mut cells = Vec::with_capacity(frame.x.n * frame.y.n);
    for (i, j) in (0..frame.y.n).flat_map(|j| (0..frame.x.n).map(move |i| (i, j))) {
        let state = if let Some(states) = &landscape.states {
            frame.listed(states, i, j).map(|cell| (cell, states[cell].fields.clone()))
        } else {
            let fields = frame.fields(i, j);
            let row = match landscape.features {
                Some(_) => Some(cells.len()),
                None => landscape.cell(&fields)?,
            };
            row.map(|cell| (cell, fields))
        };
        cells.push(match state {
            None => None,
            Some((cell, fields)) => {
                let at = |&end| landscape.phi(cell, &fields, end).transpose();
                let phi: Result<Vec<f64>, _> = ends.iter().filter_map(at).collect();
                Some((cell, phi?))
            }
        });
    }
    Ok(cells)
}

/// Whether there is a Φ of states.
fn has_potential(variant: &Variant) -> bool {
    variant.potential.is_some() || variant.shaping.shift != 0.0 || variant.shaping.learned.is_some()
}

fn label(variant: &Variant, quantity: Quantity) -> String {
    let of = if variant.changes_reward() { ", of the reward it learned from" } else { "" };
    let v = if variant.agent.is_predictor() { "V of the given policy" } else { "V = max Q" };
    match quantity {
        Quantity::Value if has_potential(variant) => {
            format!("{v} + Φ{of} (what was learned, the potential added back)")
        }
        Quantity::Value => format!("{v}{of}"),
        Quantity::Policy => "greedy action".into(),
        Quantity::Potential => "potential Φ".into(),
    }
}

fn tiles(grid: &Grid, cells: &[Spot], tables: &Tables, quantity: Quantity) -> Tiles {
    let arrows = |spot: &Spot| match spot {
        Some((cell, _)) if quantity != Quantity::Potential => {
            tables.actions(*cell).into_iter().map(|a| grid.arrows[a]).collect()
        }
        _ => String::new(),
    };
    Tiles {
        letters: grid.rows.iter().flat_map(|row| row.chars()).collect(),
        arrows: cells.iter().map(arrows).collect(),
    }
}

impl Picture {
    /// The least and the largest number in it.
    pub fn range(&self) -> Option<(f64, f64)> {
        let known = self.places.iter().filter_map(|p| p.known());
        known.fold(None, |range: Option<(f64, f64)>, x| {
            Some(range.map_or((x, x), |(low, high)| (low.min(x), high.max(x))))
        })
    }

    /// The share of a number in the range, from 0 to 1.
    pub fn share(&self, x: f64) -> f64 {
        match self.range() {
            Some((low, high)) if high > low => (x / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0),
            _ => 0.5,
        }
    }

    /// What is at column `i` and row `j`.
    pub fn place(&self, i: usize, j: usize) -> Place {
        self.places[j * self.x.n + i]
    }

    /// Whether something is shown as unknown.
    pub fn has_unknown(&self) -> bool {
        self.places.contains(&Place::Unknown)
    }

    /// The other fields in words: `, theta = 0, x = 0`.
    pub fn slice(&self) -> String {
        let one = |(name, x): &(String, f64)| format!(", {name} = {}", super::svg::coordinate(*x));
        self.at.iter().map(one).collect()
    }

    /// Everything in numbers; places without one are `null`.
    pub fn json(&self) -> Value {
        let rows = self.places.chunks(self.x.n);
        let rows: Vec<Vec<Option<f64>>> =
            rows.map(|row| row.iter().map(|p| p.known()).collect()).collect();
        let at: serde_json::Map<String, Value> =
            self.at.iter().map(|(name, x)| (name.clone(), json!(x))).collect();
        json!({
            "variant": self.variant,
            "seeds": self.seeds,
            "quantity": self.quantity.as_str(),
            "label": self.label,
            "x": self.x.json(),
            "y": self.y.json(),
            "at": at,
            "actions": self.actions,
            "arrows": self.tiles.as_ref().map(|t| {
                t.arrows.chunks(self.x.n).map(<[String]>::to_vec).collect::<Vec<_>>()
            }),
            "rows": rows,
        })
    }
}
