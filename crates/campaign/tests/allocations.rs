//! What a trial asks of the allocator. On many threads it is what they wait for each other with.

use allocation_counter::measure;
use standstill_detect::MethodName;
use standstill_plant::{built_in, built_in_names};
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::RotorState;

/// The lane of a trial that runs alone, the room for samples that have not been converted, and most that the list of readings grows: from those
/// of one command to those of the one with the most.
const MOST: u64 = 8;

/// Neither drawing a case nor making a detector takes memory from the allocator, and a run takes it only for its lane and
/// for a command's samples and readings.
#[test]
fn law_a_trial_allocates_nothing_but_its_lane_and_the_lists_of_its_readings() {
    for name in built_in_names() {
        for method in MethodName::ALL {
            // Seconds of PWM, and like the others.
            let long = method == MethodName::DcAlignment;
            for (errors, rotor) in
                [(ErrorSet::Default, RotorState::Locked), (ErrorSet::Harsh, RotorState::Free)]
            {
                let motor = built_in(name).expect("a built-in motor");
                let scenario = Scenario::of_method(method, motor, errors, rotor, 1);
                let what = format!("{name}, {method}, {errors:?}");
                let case = measure(|| {
                    std::hint::black_box(scenario.case(0));
                });
                assert_eq!(case.count_total, 0, "{what}: drawing a case");
                let detector = measure(|| {
                    let detector = standstill_detect::Settings::detector(&scenario.detector);
                    std::hint::black_box(detector.is_ok());
                });
                assert_eq!(detector.count_total, 0, "{what}: a detector");
                if long {
                    continue;
                }
                let trial = measure(|| {
                    std::hint::black_box(scenario.trial(0).is_ok());
                });
                println!("{what}: {} allocations, {} bytes", trial.count_total, trial.bytes_total);
                assert!(trial.count_total <= MOST, "{what}: {} allocations", trial.count_total);
                assert_eq!(trial.count_current, 0, "{what}: all is given back");
            }
        }
    }
}
