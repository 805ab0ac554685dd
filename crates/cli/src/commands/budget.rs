//! `standstill budget`: the contributions of error sources to the angle error.

use serde_json::json;
use standstill_analysis::{Budget, PAIRS, Source, TooFew, Trials, trials_of_budget};
use standstill_campaign::Estimate;
use standstill_report::page::{Block, Column, Table, Tone};

use super::question::{Asked, Silence, again, plan, setting, silence};
use crate::answer::{Answer, Record, Records, verdict};
use crate::arguments::Budget as Options;
use crate::error::Error;
use crate::figures::{self, Bar};
use crate::shell::command_line::quoted;
use crate::shell::{NOT_SHOWN, Report};
use standstill_quantity::{count, significant};

/// Smallest number of samples with which the shares are accurate enough. With fewer samples the answer is marked as doubtful.
const FEW: u64 = 50;
/// Number of samples that a doubtful answer recommends.
const ENOUGH: u64 = 1000;

/// A contribution to the error: one error source, the method's own error, or the interaction of several sources.
struct Part {
    source: String,
    /// Two rms errors in degrees: the first with this contribution alone, the second with all contributions except this one.
    rms: Option<[Estimate; 2]>,
    share: Estimate,
    total: Option<Estimate>,
}

impl Part {
    fn new(source: &str, rms: Option<[Estimate; 2]>, share: Estimate, total: Option<Estimate>) -> Self {
        Self { source: source.to_owned(), rms, share, total }
    }

    /// Returns four fifths of the total rms error in degrees, rounded to two digits, as a limit for `require`. None if the rms error
    /// without this contribution may exceed it: no value of its source meets the limit then.
    fn fifth_less(&self, rms_deg: f64) -> Option<f64> {
        let limit = significant(0.8 * rms_deg, 2);
        self.rms.is_some_and(|[_, without]| limit > without.high).then_some(limit)
    }

    /// Returns the cells of this contribution in the table. Each number has its interval and as many digits as the interval supports.
    fn cells(&self) -> Vec<String> {
        let cell =
            |factor: f64, of: Option<Estimate>| of.unwrap_or(Estimate::UNKNOWN).times(factor).to_string();
        let rms = |k: usize| cell(1.0, self.rms.map(|rms| rms[k]));
        vec![self.source.clone(), cell(100.0, Some(self.share)), rms(0), rms(1), cell(100.0, self.total)]
    }

    fn record(&self) -> Record {
        Record::default()
            .with("source", &self.source)
            .estimate("alone_rms", "_deg", self.rms.map(|[alone, _]| alone))
            .estimate("without_rms", "_deg", self.rms.map(|[_, without]| without))
            .estimate("share", "", Some(self.share))
            .estimate("total", "", self.total)
    }
}

/// Returns the contributions to the error, the largest share first. The interaction of sources comes last.
fn shares(budget: &Budget) -> Vec<Part> {
    let own = &budget.method;
    let mut shares =
        vec![Part::new("method", Some([own.alone_deg, own.without_deg]), own.share, Some(own.share))];
    shares.extend(budget.items.iter().map(|item| {
        let rms = [item.alone_deg, item.without_deg];
        Part::new(&item.source.key, Some(rms), item.share, Some(item.total))
    }));
    shares.sort_by(|a, b| b.share.value.total_cmp(&a.share.value));
    shares.push(Part::new("interaction", None, budget.interaction, None));
    shares
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let plan = plan(question)?;
    let trials = Trials::new(&plan)?;
    let sources = Source::all(&trials);
    if sources.is_empty() {
        let scenario = quoted(&question.scenario.to_string_lossy());
        return Err(Error::Arguments(format!(
            "{scenario}: found no error that starts draw (`errors` is \"{}\"), so the whole error is the method's own, which \
             `standstill run {scenario}` measures; needed errors to share it out among, such as -s errors=default, a key such as \
             -s 'sensors.noise=5 mA', or a table [tolerances]",
            plan.file().errors.0.name()
        )));
    }
    let pairs = options.pairs.map_or(PAIRS, u64::from);
    let named = [("--pairs", Some(pairs.to_string()))];
    let asked = match Asked::new(question, "budget", &plan, named, trials_of_budget(pairs, sources.len()))? {
        Ok(asked) => asked,
        Err(finished) => return Ok(finished),
    };
    asked.watched.bar.set_message(format!("{} sources", sources.len()));
    let found = asked.run(|| {
        let budget = Budget::of(&trials, &sources, pairs, &asked.watched)?;
        let is_most = budget.as_ref().map_or(true, is_most_left_out);
        let starts = is_most.then(|| Silence::of_axes(&plan, &asked.watched)).transpose()?;
        Ok((budget, starts))
    })?;
    let Some((budget, starts)) = found else {
        return Ok(asked.interrupted("the samples were not complete"));
    };
    let (setting, again) = (setting(plan.file(), trials.scenario()), again(question));
    let has_silence = starts.is_some();
    let answer = match budget {
        Ok(budget) => answer(setting, &again, &budget, starts.as_ref()),
        Err(too_few) => unanswered(setting, &again, &too_few, starts.as_ref()),
    };
    let answer = if has_silence { silence::lead(answer, question, plan.file()) } else { answer };
    asked.answer(trials.scenario(), answer)
}

/// Returns true if more than half of the samples are left out. A sample is left out if a simulated start in it has no axis.
const fn is_most_left_out(budget: &Budget) -> bool {
    2 * budget.dropped > budget.pairs
}

/// Returns the answer if too few simulated starts have an axis. Their error then cannot be divided among the sources.
fn unanswered(setting: String, asked: &str, too_few: &TooFew, starts: Option<&Silence>) -> Answer {
    let TooFew { pairs, whole, needed } = too_few;
    let headline = format!(
        "No error to share out: of {pairs} pairs of starts {whole} have an axis in all that was tried, needed {needed}"
    );
    let details = starts.map(Silence::sentence).into_iter().collect();
    let answer = Answer::new(
        "budget",
        "Where the error comes from".to_owned(),
        setting,
        verdict(Tone::Bad, headline, details),
        Vec::new(),
    );
    let json = json!({
        "rms_deg": null,
        "sources": [],
        "pairs": pairs,
        "dropped": pairs - whole,
        "plain_starts": starts.map(Silence::json),
    });
    let answer = Answer { json, csv: Some(Records::default()), code: NOT_SHOWN, ..answer };
    if *whole == 0 {
        return answer;
    }
    let enough = pairs * needed * 2 / whole;
    answer.next("pairs of which enough have an axis", format!("standstill budget {asked} --pairs {enough}"))
}

fn answer(setting: String, asked: &str, budget: &Budget, starts: Option<&Silence>) -> Answer {
    let shares = shares(budget);
    let records: Records = shares.iter().map(Part::record).collect();
    let json = json!({
        "rms_deg": budget.rms_deg.value,
        "rms_low_deg": budget.rms_deg.low,
        "rms_high_deg": budget.rms_deg.high,
        "sources": records,
        "trials": budget.trials,
        "pairs": budget.pairs,
        "dropped": budget.dropped,
        "plain_starts": starts.map(Silence::json),
    });
    let three = |e: &Estimate| [e.value, e.low, e.high];
    let bar = |share: &Part| Bar {
        name: share.source.clone(),
        share: three(&share.share),
        total: share.total.as_ref().map(three),
    };
    let bars: Vec<Bar> = shares.iter().map(bar).collect();
    let [value, low, high] = budget.rms_deg.texts();
    let kept = budget.pairs - budget.dropped;
    let is_doubtful = is_most_left_out(budget) || kept < FEW;
    let doubt = if is_doubtful {
        format!("doubtful, of {kept} of {} samples: ", budget.pairs)
    } else {
        String::new()
    };
    let headline = format!("{doubt}rms error of the axis {value}° [{low}, {high}]");
    let blocks = vec![Block::Table(table(&shares)), Block::Text(legend(budget).join("\n\n"))];
    let tone = if is_doubtful { Tone::Warning } else { Tone::Neutral };
    let details = notes(budget).into_iter().chain(starts.map(Silence::sentence)).collect();
    let verdict = verdict(tone, headline, details);
    let of_shares = figures::shares(&bars, setting.clone());
    let over_angle = figures::over_angle(budget, &setting);
    let answer = Answer::new("budget", "Where the error comes from".to_owned(), setting, verdict, blocks)
        .with("budget", of_shares, "Shares sum to one. Totals count an interaction with each source that has a part in it.")
        .with("over_angle", over_angle, "Mean squares, which add up: of the sources by themselves, the largest four, with 95 % intervals. Where a source has next to no part, an estimate may lie below zero.");
    let answer = Answer { json, csv: Some(records), ..answer };
    if is_doubtful {
        let pairs = (ENOUGH * budget.pairs).div_ceil(kept.max(1));
        return answer
            .next("enough samples that have an axis", format!("standstill budget {asked} --pairs {pairs}"));
    }
    let Some(first) = shares.first() else { return answer };
    let percent = (100.0 * first.share.value).round();
    let limit = first.fifth_less(budget.rms_deg.value);
    if !standstill_scenario::keys().any(|key| key.path == first.source) {
        let because = format!(
            "the largest part, {percent} %, is no part of the drive ({}): other methods, in some minutes",
            first.source
        );
        answer.next(because, format!("standstill compare {asked}"))
    } else if let Some(limit) = limit {
        answer.next(
            format!(
                "{} makes {percent} % of it: how good must it be for a fifth less error? (some minutes)",
                first.source
            ),
            format!(
                "standstill require {asked} --key {} --limit 'rms <= {} deg'",
                first.source,
                standstill_quantity::short(limit)
            ),
        )
    } else {
        let because = format!(
            "{} makes {percent} % of it, and no value of it takes a fifth off the error: other methods, in some minutes",
            first.source
        );
        answer.next(because, format!("standstill compare {asked}"))
    }
}

fn table(shares: &[Part]) -> Table {
    let columns = [
        Column::word("source"),
        // On a narrow terminal the intervals are dropped before any column.
        Column::number("share").unit("%").bracket(4),
        Column::number("alone").unit("°").rank(1).bracket(5),
        Column::number("without").unit("°").rank(2).bracket(5),
        Column::number("total").unit("%").rank(3).bracket(5),
    ];
    Table::new(columns).rows(shares.iter().map(Part::cells))
}

/// Returns notes on the intervals and on the samples that were left out.
fn notes(budget: &Budget) -> Vec<String> {
    let mut notes = vec![format!(
        "[95 % interval], Sobol' indices at each angle, averaged over it; {} trials",
        count(budget.trials)
    )];
    if budget.dropped > 0 {
        notes.push(format!(
            "{} of {} samples left out: one of their starts had no axis. The odds of that are no part of a budget",
            count(budget.dropped),
            count(budget.pairs)
        ));
    }
    notes
}

/// Returns paragraphs that explain the columns and the rows of the table.
fn legend(budget: &Budget) -> Vec<String> {
    let mut legend = [
        "share: of the mean square, by the source itself; total: with all in which it has a part.",
        "alone: rms with this source, all others at their means; without: rms of all others.",
        "method: its own error at each angle, which no better part removes. interaction: what sources make only together.",
    ]
    .map(str::to_owned)
    .to_vec();
    legend.extend(budget.items.iter().filter(|item| item.source.is_rounding()).map(|item| {
        format!(
            "{}: what converters round, by the place of their codes. Where noise moves readings by more than a code, it has \
             no share by itself: its total is interaction with whatever moves readings. The others alone are without it.",
            item.source.key
        )
    }));
    legend
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shell::table::Print as _;

    #[test]
    fn regress_a_limit_that_the_other_sources_exceed_by_themselves_is_not_proposed() {
        let part = |without: f64| {
            let known = |value: f64| Estimate { value, low: value - 0.01, high: value + 0.01 };
            Part::new("sensors.gain_error", Some([known(0.9), known(without)]), known(0.4), None)
        };
        // Of 1.669°, 1.310° remain without the gain errors, so a limit of 1.3° cannot be met. Just above 1.310° it may not be met either.
        assert_eq!(part(1.310).fifth_less(1.669), None);
        assert_eq!(part(1.295).fifth_less(1.669), None);
        assert_eq!(part(1.1).fifth_less(1.669), Some(1.3));
    }

    #[test]
    fn law_eighty_columns_have_all_columns_of_a_budget_and_its_shares_have_their_intervals() {
        let estimate = |value: f64| Estimate { value, low: value - 0.0213, high: value + 0.0213 };
        let row = |source| {
            Part::new(
                source,
                Some([estimate(0.645), estimate(0.638)]),
                estimate(0.408),
                Some(estimate(0.459)),
            )
        };
        let rows = [row("sensors.gain_error"), row("tolerances.motor.winding.resistance")];
        let text = table(&rows).within(80, false);
        for title in ["share %", "alone °", "without °", "total %"] {
            assert!(text.contains(title), "{title} in\n{text}");
        }
        assert!(text.contains("the brackets of alone °, without °, total %"), "{text}");
        let first = text.lines().find(|line| line.contains("sensors.gain_error")).expect("a row");
        assert!(first.contains("40.8 [") && text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }
}
