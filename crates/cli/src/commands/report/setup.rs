//! What was simulated: motor, drive and sensors with the values that the scenario makes of them.

use std::path::Path;

use standstill_quantity::{listed, number};
use standstill_report::page::{Block, Table, TableColumn};
use standstill_scenario::{Document, Plan, ScenarioFile};

use super::Run;

/// Facts of drive and sensors, and the motor's data sheet. Of a sweep those of its first point, where they are no axis.
pub fn blocks(run: &Run) -> Vec<Block> {
    let document = Document::parse(Path::new("scenario"), &run.summary.run.scenario);
    let found = document.and_then(|mut document| {
        if let Some(fence) = &run.fence {
            document.fence(Some(fence))?;
        }
        Ok((document.data_sheet()?, Plan::new(document)?))
    });
    let (sheet, plan) = match found {
        Ok(found) => found,
        // A motor's own file may be elsewhere, or another by now.
        Err(error) => {
            return vec![Block::Text(format!(
                "Not shown, because the scenario's files are not here: {error}"
            ))];
        }
    };
    let mut blocks = vec![Block::Facts(facts(&plan, &run.file))];
    if !run.file.axes.contains_key("motor") {
        let rows = sheet.entries().into_iter();
        let rows = rows.map(|entry| vec![entry.key, entry.value, entry.source.to_string(), entry.reason]);
        blocks.push(Block::Table(Table {
            caption: format!("Data sheet of {}; rms values, where any, say so", sheet.title()),
            columns: ["key", "value", "source", "reason"].map(TableColumn::text).to_vec(),
            rows: rows.collect(),
        }));
    }
    blocks
}

fn facts(plan: &Plan, file: &ScenarioFile) -> Vec<(String, String)> {
    let Ok(scenario) = plan.scenario(0) else { return Vec::new() };
    let (drive, sensors) = (&scenario.drive, &scenario.sensors);
    let one = |value: f64, unit: &str| listed(&[value], unit).trim_end().to_owned();
    let percent = |share: f64| format!("{} %", number(3, 100.0 * share));
    let devices = drive.bridge.devices;
    let mut facts = vec![
        ("inverter.dc_link", one(drive.link.voltage, "V")),
        ("inverter.ripple", one(drive.link.ripple, "V")),
        ("inverter.dead_time", one(drive.dead_time.seconds(), "s")),
        ("inverter.delay_mismatch", one(drive.delay_mismatch, "s")),
        ("inverter.switch_drop", one(devices.switch_drop, "V")),
        ("inverter.switch_resistance", one(devices.switch_resistance, "Ω")),
        ("inverter.diode_drop", one(devices.diode_drop, "V")),
        ("inverter.diode_resistance", one(devices.diode_resistance, "Ω")),
        ("sensors.noise", one(sensors.noise, "A")),
        ("sensors.gain_error", percent(sensors.gain_error)),
        ("sensors.offset", one(sensors.offset, "A")),
        ("sensors.jitter", one(sensors.jitter.seconds(), "s")),
        ("sensors.sample_delay", one(sensors.sample_delay.seconds(), "s")),
        ("sensors.dc_link_noise", one(sensors.dc_link.noise, "V")),
        ("sensors.dc_link_gain_error", percent(sensors.dc_link.gain_error)),
        ("sensors.dc_link_offset", one(sensors.dc_link.offset, "V")),
    ];
    if let Some(adc) = sensors.adc {
        facts.push(("sensors.bits", adc.bits.to_string()));
        facts.push(("sensors.range", one(adc.high, "A")));
    }
    if let Some(bandwidth) = sensors.bandwidth {
        facts.push(("sensors.bandwidth", one(bandwidth, "Hz")));
    }
    let value = |(key, value): (&str, String)| {
        let value = if file.axes.contains_key(key) { "varied".to_owned() } else { value };
        (key.to_owned(), value)
    };
    facts.into_iter().map(value).collect()
}
