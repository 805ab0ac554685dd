extern crate std;
use std::string::ToString;
use std::vec::Vec;

use super::*;
use crate::checks::Check;
use crate::nameplate::{Comparing, Nameplate, Sensing};
use crate::parts::polarity::{PolarityRule, SequentialSettings};
use crate::settings::Settings;
use crate::testing::PLATE;
use crate::{Method, MethodName};

/// Returns a value of a key that works and that no method has by default.
fn other(key: &Key) -> Value {
    match key.name {
        "pulse" => Value::Number(60e-6),
        "rest" | "pause" => Value::Number(1.2),
        "rounds" => Value::Number(5.0),
        "least_saliency" => Value::Number(0.03),
        "vector_current" | "threshold" => Value::Number(6.5),
        "pole_error" => Value::Number(1e-3),
        "gain_tolerance" => Value::Number(0.01),
        "bandwidth" => Value::Number(2e5),
        "deviation" => Value::Number(0.5),
        "window" => Value::Number(9e-6),
        "voltage" => Value::Number(40.0),
        "compensation" | "comparison" | "timed" => Value::Flag(false),
        "checks" => Value::Checks(Checks::ALL.without(Check::Turning)),
        "pairs" => Value::Flag(true),
        "sector" => Value::Number(30.0),
        other => panic!("{other} is not tried"),
    }
}

#[test]
fn law_what_is_set_is_what_is_got_and_nothing_else_changes() {
    // With a timer, so that six pulses are timed.
    let comparator = Comparing { tick: 1e-6, ..Comparing::default() };
    let plate = Nameplate { sensing: Sensing { comparator, ..PLATE.sensing }, ..PLATE };
    for name in MethodName::ALL {
        let suited = Method::<f64>::suited(name, &plate);
        for key in ALL {
            let mut changed = suited;
            let before = suited.get(key);
            let is_set = changed.set(key, other(key));
            assert_eq!(is_set, before.is_some(), "{name} {}", key.name);
            if !is_set {
                assert_eq!(changed, suited, "{name} {}", key.name);
                continue;
            }
            assert!(suited.has(key));
            assert_ne!(before, Some(other(key)));
            let (found, wanted) = (changed.get(key).expect("set").number(), other(key).number());
            assert!((found - wanted).abs() <= 1e-12, "{name} {}: {found}", key.name);
            // One round of sampled currents does not show how they scatter.
            let works = changed.detector();
            assert!(works.is_ok() || key.name == "timed", "{name} {}", key.name);
            for same in ALL.into_iter().filter(|same| same.name != key.name) {
                assert_eq!(changed.get(same), suited.get(same), "{name} {} by {}", same.name, key.name);
            }
        }
    }
}

#[test]
fn law_each_key_is_one_method_s_at_least_and_its_suited_value_is_in_range() {
    // Keys of one shunt in the DC link exist only with such a shunt.
    let shunt = Nameplate { sensing: Sensing { place: crate::Place::InLink, ..PLATE.sensing }, ..PLATE };
    let suited = |plate: &Nameplate<f64>| MethodName::ALL.map(|name| Method::<f64>::suited(name, plate));
    for key in ALL {
        let values: Vec<Value> =
            [PLATE, shunt].iter().flat_map(suited).filter_map(|method| method.get(key)).collect();
        assert!(!values.is_empty(), "{}", key.name);
        assert!(key.about.ends_with('.') && !key.about.contains('\n'), "{}", key.name);
        if let Kind::Number { range: [low, high], whole, needed, .. } = key.kind {
            assert!(!needed.to_string().is_empty());
            for value in values {
                let value = value.number();
                assert!((low..=high).contains(&value) && (!whole || value.fract() == 0.0), "{}", key.name);
            }
        }
    }
    assert!(ALL.iter().enumerate().all(|(k, key)| ALL[..k].iter().all(|before| before.name != key.name)));
}

#[test]
fn law_the_error_of_a_pole_is_a_key_only_where_the_rule_knows_one() {
    let mut method = Method::<f64>::suited(MethodName::LineInductanceFast, &PLATE);
    assert!(method.has(&POLE_ERROR) && method.get(&POLE_ERROR).is_none());
    assert!(!method.set(&POLE_ERROR, Value::Number(1e-4)));
    let polarity = method.polarity_mut().expect("a test");
    polarity.rule = PolarityRule::Sequential(SequentialSettings::new(0.1));
    assert!(method.set(&POLE_ERROR, Value::Number(1e-4)));
    assert_eq!(method.get(&POLE_ERROR), Some(Value::Number(1e-4)));
    let adaptive = Method::<f64>::suited(MethodName::MaximumLikelihoodAdaptive, &PLATE);
    let fixed = Method::<f64>::suited(MethodName::MaximumLikelihood, &PLATE);
    assert!(adaptive.get(&DEVIATION).is_some() && fixed.get(&DEVIATION).is_none());
}

#[test]
fn regress_every_rest_in_the_stated_range_works() {
    let Kind::Number { range, .. } = REST.kind else { panic!("a number") };
    for name in [
        MethodName::Bipolar,
        MethodName::MaximumLikelihood,
        MethodName::MaximumLikelihoodAdaptive,
        MethodName::OpenTerminal,
    ] {
        for (share, pulse) in range.into_iter().flat_map(|share| [1e-6, 60e-6].map(|pulse| (share, pulse))) {
            let mut method = Method::<f64>::suited(name, &PLATE);
            assert!(method.set(&PULSE, Value::Number(pulse)));
            if !method.set(&REST, Value::Number(share)) {
                continue;
            }
            // Of a pulse so short other settings may not fit, but never the rest.
            let refused = method.detector().err().map(|error| error.setting);
            assert!(
                !refused.is_some_and(|setting| setting.contains("rest")),
                "{name} {share} {pulse}: {refused:?}"
            );
        }
    }
}

#[test]
fn law_methods_with_a_list_of_checks_have_some_and_each_check_is_one_s() {
    for name in MethodName::ALL {
        let has_list = Method::<f64>::suited(name, &PLATE).has(&CHECKS);
        assert_eq!(has_list, name.checks() != Checks::NONE, "{name}");
    }
    for check in Check::ALL {
        assert!(MethodName::ALL.iter().any(|name| name.checks().has(check)), "{}", check.name());
    }
}

#[test]
fn regress_a_number_is_no_list_of_checks() {
    for name in MethodName::ALL {
        let suited = Method::<f64>::suited(name, &PLATE);
        let mut method = suited;
        // 2 is the number of a check, 1 stands for all where there are numbers alone.
        for number in [0.0, 1.0, 2.0, 0.5] {
            assert!(!method.set(&CHECKS, Value::Number(number)), "{name} {number}");
            assert_eq!(method, suited);
        }
        assert!(method.set(&CHECKS, Value::Flag(false)));
        assert_eq!(method.get(&CHECKS), Some(Value::Checks(Checks::NONE)));
        assert!(method.set(&CHECKS, Value::Flag(true)));
        assert_eq!(method.get(&CHECKS), Some(Value::Checks(Checks::ALL)));
    }
}
