//! Judgement of which of two runs is better, by measures in the order of their importance: wrong poles, then answers,
//! then the error.

use super::Estimate;

/// Differences of the second run, B, from the first, A, with 95 % intervals. An interval that holds zero, or is not known, shows
/// no difference.
#[derive(Clone, Copy, Debug)]
pub struct Apart {
    /// Share of starts that end with the wrong pole.
    pub wrong: Estimate,
    /// Share of starts that end without an angle and a pole.
    pub unanswered: Estimate,
    /// Error in degrees of the starts in which both found an axis.
    pub error: Estimate,
}

/// Verdict on the differences that are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// All significant differences favour B.
    Better,
    /// All significant differences favour A.
    Worse,
    /// Some significant differences favour A, others B.
    Mixed,
    /// No difference is significant.
    Open,
}

/// Returns true if the difference is significantly negative, false if significantly positive, none otherwise.
fn shown(apart: Estimate) -> Option<bool> {
    match (apart.high < 0.0, apart.low > 0.0) {
        (true, _) => Some(true),
        (_, true) => Some(false),
        _ => None,
    }
}

impl Apart {
    /// Returns for each measure whether B is shown to have less of it, in the order that counts.
    fn each(&self) -> [Option<bool>; 3] {
        [self.wrong, self.unanswered, self.error].map(shown)
    }

    /// Returns which run is better.
    pub fn judgement(&self) -> Judgement {
        let each = self.each();
        match (each.contains(&Some(true)), each.contains(&Some(false))) {
            (true, true) => Judgement::Mixed,
            (true, _) => Judgement::Better,
            (_, true) => Judgement::Worse,
            _ => Judgement::Open,
        }
    }

    /// Returns the verdict in words. They are better or worse only if no difference contradicts that.
    ///
    /// ```
    /// use standstill_campaign::{Apart, Estimate};
    ///
    /// let of = |value: f64, half: f64| Estimate { value, low: value - half, high: value + half };
    /// let mixed = Apart { wrong: of(0.0, 0.01), unanswered: of(0.6, 0.1), error: of(-0.4, 0.1) };
    /// assert_eq!(mixed.in_words(), "B answers less, is more exact where both find the axis");
    /// let better = Apart { unanswered: of(0.0, 0.1), ..mixed };
    /// assert_eq!(better.in_words(), "B is better: it is more exact");
    /// ```
    pub fn in_words(&self) -> String {
        let [wrong, unanswered, error] = self.each();
        let pick = |less: bool, words: [&'static str; 2]| if less { words[0] } else { words[1] };
        let exact = error.map(|less| {
            let words = pick(less, ["is more exact", "is less exact"]);
            if unanswered.is_some() { format!("{words} where both find the axis") } else { words.to_owned() }
        });
        let clauses: Vec<String> = [
            wrong.map(|less| pick(less, ["names fewer wrong poles", "names more wrong poles"]).to_owned()),
            unanswered.map(|less| pick(less, ["answers more", "answers less"]).to_owned()),
            exact,
        ]
        .into_iter()
        .flatten()
        .collect();
        let said = clauses.join(", ");
        match self.judgement() {
            Judgement::Better => format!("B is better: it {said}"),
            Judgement::Worse => format!("B is worse: it {said}"),
            Judgement::Mixed => format!("B {said}"),
            Judgement::Open => "no difference shown".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LESS: Estimate = Estimate { value: -0.2, low: -0.3, high: -0.1 };
    const MORE: Estimate = Estimate { value: 0.2, low: 0.1, high: 0.3 };
    const OPEN: Estimate = Estimate { value: -0.2, low: -0.5, high: 0.1 };

    #[test]
    fn law_wrong_poles_come_first_then_answers_then_the_error() {
        for (wrong, unanswered, error, said) in [
            (OPEN, OPEN, OPEN, "no difference shown"),
            (Estimate::UNKNOWN, OPEN, Estimate::UNKNOWN, "no difference shown"),
            (OPEN, OPEN, LESS, "B is better: it is more exact"),
            (OPEN, OPEN, MORE, "B is worse: it is less exact"),
            (OPEN, LESS, OPEN, "B is better: it answers more"),
            (LESS, OPEN, Estimate::UNKNOWN, "B is better: it names fewer wrong poles"),
            (MORE, MORE, OPEN, "B is worse: it names more wrong poles, answers less"),
            // Two of three starts without a pole are no better for being exact.
            (OPEN, MORE, LESS, "B answers less, is more exact where both find the axis"),
            (OPEN, LESS, MORE, "B answers more, is less exact where both find the axis"),
            (LESS, MORE, OPEN, "B names fewer wrong poles, answers less"),
            (
                MORE,
                LESS,
                LESS,
                "B names more wrong poles, answers more, is more exact where both find the axis",
            ),
            (MORE, OPEN, LESS, "B names more wrong poles, is more exact"),
        ] {
            let apart = Apart { wrong, unanswered, error };
            assert_eq!(apart.in_words(), said);
            let judged = [
                ("B is better", Judgement::Better),
                ("B is worse", Judgement::Worse),
                ("no", Judgement::Open),
            ];
            let expected = judged.into_iter().find(|(head, _)| said.starts_with(head));
            assert_eq!(apart.judgement(), expected.map_or(Judgement::Mixed, |(_, judged)| judged), "{said}");
        }
    }
}
