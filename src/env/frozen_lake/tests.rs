use super::*;

fn lake(desc: &[&str], ice: &Ice) -> Result<FrozenLake, EnvError> {
    let desc: Vec<String> = desc.iter().map(|&row| row.to_owned()).collect();
    FrozenLake::new(&desc, ice)
}

fn outcome(probability: f64, next_state: u32, reward: f64, terminated: bool) -> Outcome {
    Outcome { probability, next_state, reward, terminated }
}

#[test]
fn slippery_outcomes_by_hand() {
    // Moving right from the start: astray down into the hole (a - 1), right (a), or up, which stays.
    let env = lake(&["SF", "HG"], &Ice { success_rate: 0.8, ..Ice::default() }).unwrap();
    let slide = (1.0 - 0.8) / 2.0;
    assert_eq!(
        env.finite().unwrap().of(0, RIGHT),
        [outcome(slide, 2, 0.0, true), outcome(0.8, 1, 0.0, false), outcome(slide, 0, 0.0, false)]
    );
    assert_eq!(env.finite().unwrap().of(1, DOWN)[1], outcome(0.8, 3, 1.0, true));
    assert_eq!(env.finite().unwrap().of(3, UP), [outcome(1.0, 3, 0.0, true)]);
}

#[test]
fn firm_ice_and_a_schedule() {
    let ice = Ice { is_slippery: false, reward_schedule: [10.0, -10.0, -1.0], ..Ice::default() };
    let env = lake(&["SXG", "FHF"], &ice).unwrap();
    let mdp = env.finite().unwrap();
    // An unknown letter is ice; staying at the border pays like entering the tile.
    assert_eq!(mdp.of(0, RIGHT), [outcome(1.0, 1, -1.0, false)]);
    assert_eq!(mdp.of(0, LEFT), [outcome(1.0, 0, -1.0, false)]);
    assert_eq!(mdp.of(1, DOWN), [outcome(1.0, 4, -10.0, true)]);
    assert_eq!(mdp.of(1, RIGHT), [outcome(1.0, 2, 10.0, true)]);
    // The reward inside the goal is 0, not the schedule's.
    assert_eq!(mdp.of(2, LEFT), [outcome(1.0, 2, 0.0, true)]);
}

#[test]
fn several_starts_share_the_probability() {
    let env = lake(&["SFS", "SFG"], &Ice::default()).unwrap();
    let third = 1.0 / 3.0;
    assert_eq!(env.finite().unwrap().initial(), [third, 0.0, third, third, 0.0, 0.0]);
}

#[test]
fn scripts_see_rows_columns_tiles_and_facts() {
    let env = lake(&["SFF", "FHG"], &Ice::default()).unwrap();
    let mut out = [0.0; 4];
    env.fields(&FiniteState { index: 5, outcome: FiniteState::START }, &mut out);
    assert_eq!(out, [1.0, 2.0, 5.0, f64::from(u32::from('G'))]);
    let schema = env.schema();
    let names: Vec<_> = schema.fields.iter().map(|field| field.name).collect();
    assert_eq!(names, ["row", "col", "index", "tile"]);
    let facts: Vec<_> = schema.facts.iter().map(|&(name, _, value)| (name, value)).collect();
    assert_eq!(facts, [("rows", 2.0), ("cols", 3.0), ("goal_row", 1.0), ("goal_col", 2.0)]);
    assert_eq!(schema.grid.unwrap().rows, ["SFF", "FHG"]);

    let facts = lake(&["SF"], &Ice::default()).unwrap().schema().facts;
    assert_eq!(facts.len(), 2, "a map without a goal has no goal_row");
}

#[test]
fn bad_maps_and_numbers_are_named() {
    let nan = Ice { success_rate: f64::NAN, ..Ice::default() };
    let infinite = Ice { reward_schedule: [1.0, f64::INFINITY, 0.0], ..Ice::default() };
    let ice = Ice::default();
    let short = "`desc` must have at least one row of at least two tiles, not ";
    for (desc, ice, key, message) in [
        (&[][..], ice, "desc", &*format!("{short}no rows")),
        (&["S", "F", "G"], ice, "desc", &format!("{short}a first row that is shorter")),
        (
            &["SF", "F"],
            ice,
            "desc",
            "the rows of `desc` must be equally long: row 1 (`F`) has 1 tiles, row 0 has 2",
        ),
        (&["FG"], ice, "desc", "`desc` must have a start tile `S`"),
        (
            &["SF", "Fg"],
            ice,
            "desc",
            "a tile of `desc` must be a capital letter (S start, G goal, H hole, F ice), not `g` \
             in row 1 (`Fg`)",
        ),
        (&["SG"], nan, "success_rate", "`success_rate` must be between 0 and 1, not NaN"),
        (
            &["SG"],
            infinite,
            "reward_schedule",
            "`reward_schedule` must hold finite numbers, not inf",
        ),
    ] {
        let error = lake(desc, &ice).unwrap_err();
        assert_eq!(error.message, message);
        assert_eq!(error.key.as_deref(), Some(key));
    }
    assert_eq!(lake(&["Sg"], &ice).unwrap_err().hint.as_deref(), Some("did you mean `G`?"));
}
