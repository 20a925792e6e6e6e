use super::*;
use crate::mdp::Outcome;

fn hand(cards: &[u8]) -> Hand {
    let mut hand = Hand::EMPTY;
    for &card in cards {
        hand.cards[hand.len] = card;
        hand.len += 1;
        hand.hard += u32::from(card);
        hand.has_ace |= card == 1;
    }
    hand
}

fn table(rules: Rules, player: &[u8], dealer: &[u8]) -> Blackjack {
    Blackjack { player: hand(player), dealer: hand(dealer), ..Blackjack::new(rules) }
}

#[test]
fn sums_by_hand() {
    for (cards, sum, usable, natural) in [
        (&[1, 10][..], 21, true, true),
        (&[1, 1], 12, true, false),
        (&[1, 1, 10], 12, false, false),
        (&[1, 5, 5], 21, true, false),
        (&[10, 10, 1], 21, false, false),
        (&[10, 6, 6], 22, false, false),
    ] {
        let hand = hand(cards);
        assert_eq!((hand.sum(), hand.has_usable_ace(), hand.is_natural()), (sum, usable, natural));
    }
}

#[test]
fn naturals_pay_by_the_rules() {
    const NATURAL: &[u8] = &[1, 10];
    const THREE_CARDS: &[u8] = &[1, 4, 6];
    for (player, dealer, plain, natural, sab) in [
        (NATURAL, &[10, 9][..], 1.0, 1.5, 1.0),
        (NATURAL, THREE_CARDS, 0.0, 0.0, 1.0),
        (NATURAL, NATURAL, 0.0, 0.0, 0.0),
        (THREE_CARDS, &[10, 9], 1.0, 1.0, 1.0),
        (THREE_CARDS, NATURAL, 0.0, 0.0, 0.0),
        (&[10, 8], &[10, 9], -1.0, -1.0, -1.0),
        (&[2, 3], &[10, 6, 10], 1.0, 1.0, 1.0),
    ] {
        let rewards = [Rules::Plain, Rules::Natural, Rules::SuttonBarto]
            .map(|rules| table(rules, player, dealer).compare());
        assert_eq!(rewards, [plain, natural, sab], "{player:?} against {dealer:?}");
    }
}

#[test]
fn the_dealer_stands_on_a_soft_seventeen() {
    let mut env = table(Rules::Plain, &[10, 7], &[1, 6]);
    let step = env.step(STICK, &mut NumpyRng::from_u64(0));
    assert_eq!(env.dealer_cards(), [1, 6]);
    assert_eq!((step.reward, step.terminated), (0.0, true));
}

#[test]
fn a_card_by_hand() {
    let env = Blackjack::new(Rules::SuttonBarto);
    let mdp = env.finite().unwrap();
    let hit = |player, ace| -> Vec<(usize, bool, bool)> {
        let outcomes = mdp.of(model::index(player, 7, ace), 1);
        outcomes
            .iter()
            .map(|o| {
                let (player, dealer, ace, natural) = model::decode(o.next_state as usize);
                assert_eq!((dealer, natural), (7, false));
                assert_eq!(o.reward, if o.terminated { -1.0 } else { 0.0 });
                (player, ace, o.terminated)
            })
            .collect()
    };
    // By an ace, a five and a ten.
    let some = |list: &[_]| [list[0], list[4], list[9]];
    assert_eq!(some(&hit(10, false)), [(21, true, false), (15, false, false), (20, false, false)]);
    assert_eq!(some(&hit(11, false)), [(12, false, false), (16, false, false), (21, false, false)]);
    assert_eq!(some(&hit(17, true)), [(18, true, false), (12, false, false), (17, false, false)]);
    assert_eq!(some(&hit(17, false)), [(18, false, false), (22, false, true), (27, false, true)]);
    let share = |i: usize| mdp.of(model::index(17, 7, false), 1)[i].probability;
    assert_eq!((share(0), share(9)), (1.0 / 13.0, 4.0 / 13.0));
}

#[test]
fn sticking_on_a_natural_meets_a_natural_only() {
    let outcome = |probability, next: usize, reward| Outcome {
        probability,
        next_state: next as u32,
        reward,
        terminated: true,
    };
    let env = Blackjack::new(Rules::SuttonBarto);
    let ten = model::natural(10);
    assert_eq!(ten, 713);
    assert_eq!(
        env.finite().unwrap().of(ten, STICK),
        [outcome(0.0, ten, -1.0), outcome(1.0 / 13.0, ten, 0.0), outcome(12.0 / 13.0, ten, 1.0)]
    );
    // Nothing is dealt from a five that is a natural.
    let five = model::natural(5);
    assert_eq!(env.finite().unwrap().of(five, STICK)[2], outcome(1.0, five, 1.0));
}

#[test]
fn every_row_is_a_distribution() {
    for rules in [Rules::Plain, Rules::Natural, Rules::SuttonBarto] {
        let mdp = model::model(rules).unwrap();
        assert!((mdp.initial().iter().sum::<f64>() - 1.0).abs() < 1e-12);
        for s in 0..mdp.n_states() {
            for a in 0..N_ACTIONS {
                let sum: f64 = mdp.of(s, a).iter().map(|o| o.probability).sum();
                assert!((sum - 1.0).abs() < 1e-12, "state {s}, action {a}: {sum}");
            }
        }
        // Hard sums of 4 to 21 but 21 with a ten of cards, soft ones of 12 to 21, and the naturals,
        // each against ten cards.
        let reachable = mdp.reachable().iter().filter(|&&r| r).count();
        assert_eq!(reachable, (18 + 10 + 1) * 10);
    }
}

#[test]
fn indices_and_observations_belong_together() {
    let env = Blackjack::new(Rules::SuttonBarto);
    for index in 0..model::N_STATES {
        assert_eq!(env.state_index(&env.state(index).unwrap()), Some(index));
    }
    let mut out = [0.0; 5];
    env.fields(&env.state(model::natural(3)).unwrap(), &mut out);
    assert_eq!(out, [21.0, 3.0, 1.0, 706.0, 1.0]);
    env.fields(&env.state(model::index(14, 10, false)).unwrap(), &mut out);
    assert_eq!(out, [14.0, 10.0, 0.0, 328.0, 0.0]);
}

#[test]
fn stepping_on_beyond_everything_is_harmless() {
    let mut env = Blackjack::new(Rules::SuttonBarto);
    let mut rng = NumpyRng::from_u64(1);
    env.reset(&mut rng);
    for _ in 0..100 {
        env.step(1, &mut rng);
    }
    let step = env.step(1, &mut rng);
    assert!(step.terminated && step.reward == -1.0 && step.obs.player > MAX_SUM);
    assert_eq!((env.state_index(&step.obs), env.outcome_index(&step.obs)), (None, None));
    assert_eq!(env.player_cards().len(), MAX_CARDS);
    assert_eq!(env.step(STICK, &mut rng).obs.player, step.obs.player);
}

#[test]
fn the_open_card_has_a_suit_and_a_face() {
    let mut env = Blackjack::new(Rules::SuttonBarto);
    let mut rng = NumpyRng::from_u64(0);
    let (mut suits, mut faces) = (Vec::new(), Vec::new());
    for _ in 0..100 {
        env.reset(&mut rng);
        suits.push(env.dealer_suit());
        faces.extend(env.dealer_face());
        assert_eq!(env.dealer_face().is_some(), env.dealer_cards()[0] == TEN);
    }
    assert!("CDHS".chars().all(|suit| suits.contains(&suit)));
    assert!("JQK".chars().all(|face| faces.contains(&face)));
}
