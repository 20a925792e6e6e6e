use serde_json::{Map, json};

use super::*;
use crate::env::make;

fn taxi(fickle: Option<f64>) -> Taxi {
    Taxi::new(&Whims { rainy: None, fickle }).unwrap()
}

fn at(row: usize, col: usize, passenger: usize, destination: usize) -> TaxiState {
    TaxiState { row, col, passenger, destination }
}

#[test]
fn states_have_gymnasiums_numbers() {
    // Gymnasium's own example: taxi at (3, 1), passenger at Y, destination R.
    assert_eq!(at(3, 1, 2, 0).encode(), 328);
    for index in 0..500 {
        assert_eq!(TaxiState::decode(index).encode(), index);
    }
}

#[test]
fn a_ride_by_hand() {
    let env = taxi(None);
    let mdp = env.finite().unwrap();
    let only = |state: TaxiState, action| {
        let [outcome] = mdp.of(state.encode(), action) else { panic!("one outcome") };
        let next = TaxiState::decode(outcome.next_state as usize);
        (next, outcome.reward, outcome.terminated)
    };
    // Walls: to the east of (0, 1), to the west of (3, 1); the border below (4, 1).
    assert_eq!(only(at(0, 1, 2, 0), 2), (at(0, 1, 2, 0), -1.0, false));
    assert_eq!(only(at(3, 1, 2, 0), 3), (at(3, 1, 2, 0), -1.0, false));
    assert_eq!(only(at(4, 1, 2, 0), 0), (at(4, 1, 2, 0), -1.0, false));
    assert_eq!(only(at(2, 1, 2, 0), 2), (at(2, 2, 2, 0), -1.0, false));
    // The passenger at Y gets in, is carried to R, and is set down; G would be the wrong place.
    assert_eq!(only(at(4, 0, 2, 0), 4), (at(4, 0, 4, 0), -1.0, false));
    assert_eq!(only(at(3, 0, 2, 0), 4), (at(3, 0, 2, 0), -10.0, false));
    assert_eq!(only(at(0, 0, 4, 0), 5), (at(0, 0, 0, 0), 20.0, true));
    assert_eq!(only(at(0, 4, 4, 0), 5), (at(0, 4, 1, 0), -1.0, false));
    assert_eq!(only(at(1, 4, 4, 0), 5), (at(1, 4, 4, 0), -10.0, false));
}

#[test]
fn scripts_see_where_everyone_is() {
    let env = taxi(None);
    let mut out = [0.0; 10];
    let mut fields = |state: TaxiState| {
        env.fields(&env.state(state.encode()).unwrap(), &mut out);
        out
    };
    assert_eq!(fields(at(3, 1, 2, 1)), [3.0, 1.0, 2.0, 1.0, 329.0, 0.0, 4.0, 0.0, 0.0, 4.0]);
    assert_eq!(fields(at(3, 1, 4, 3)), [3.0, 1.0, 4.0, 3.0, 339.0, 1.0, 3.0, 1.0, 4.0, 3.0]);
}

#[test]
fn a_fickle_passenger_leaves_no_model() {
    let mut env = taxi(Some(1.0));
    assert!(env.finite().is_none());
    assert_eq!(env.n_states(), Some(500));
    let mut rng = NumpyRng::from_u64(3);
    let mut changes = 0;
    for _ in 0..200 {
        let obs = env.reset(&mut rng);
        let before = TaxiState::decode(env.state_index(&obs).unwrap());
        // Whoever is in the taxi changes their mind at the first move that leads anywhere.
        env.env.move_to(TaxiState { passenger: 4, row: 2, col: 2, ..before }.encode() as u32);
        for action in [5, 0, 1] {
            let step = env.step(action, &mut rng);
            assert_eq!(env.outcome_index(&step.obs), None);
            let now = TaxiState::decode(step.obs.index as usize);
            assert_eq!(now, env.now());
            assert_eq!(now.destination != before.destination, action != 5);
            changes += usize::from(action == 0 && now.destination == (before.destination + 1) % 4);
        }
    }
    // One of three, each as likely.
    assert!((45..90).contains(&changes), "{changes}");
    let mut never = taxi(Some(0.0));
    never.reset(&mut rng);
    assert!(!never.will_change);
}

#[test]
fn probabilities_are_checked() {
    for name in ["rainy_probability", "fickle_probability"] {
        for bad in [-0.1, 2.0] {
            let kwargs: Map<_, _> = [(name.to_owned(), json!(bad))].into_iter().collect();
            let error = make("Taxi-v4", &kwargs).unwrap_err();
            assert_eq!(error.key.as_deref(), Some(name));
            assert_eq!(error.message, format!("`{name}` must be between 0 and 1, not {bad}"));
        }
    }
    let nan = Whims { rainy: Some(f64::NAN), fickle: None };
    assert!(Taxi::new(&nan).is_err());
}
