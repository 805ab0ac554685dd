//! Channels and log of a detector that is traced.

use std::ffi::c_void;
use std::ptr::NonNull;

use standstill_interface::Nanos;

use crate::image::{Image, Site};

/// Channels of a detector at most.
const MOST_CHANNELS: u32 = 64;

/// Channels and log of a detector in a detection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Watched {
    /// Names of the channels.
    pub names: Vec<String>,
    /// After each call, the values of the channels.
    pub rows: Vec<Called<Vec<f64>>>,
    /// Lines of the log.
    pub log: Vec<Called<String>>,
}

/// Something of one call of a detector.
#[derive(Clone, Debug, PartialEq)]
pub struct Called<T> {
    /// Number of the call, from 1; 0 is the making of the detector.
    pub call: u64,
    /// Time of the call since the start of the detection; none for a detector without timer. For an interrupt it is the
    /// time of its last sample, for a task the start of its run. A call at command level happens at the end of the
    /// previous command. Log lines at the end of a detector belong to its last call.
    pub time: Option<Nanos>,
    /// Content of the entry.
    pub what: T,
}

impl Watched {
    /// Keeps the present values of all channels, after a call of the detector.
    pub fn look(
        &mut self,
        image: &mut Image,
        site: Site,
        detector: NonNull<c_void>,
        call: u64,
        time: Option<Nanos>,
    ) {
        let first = self.rows.is_empty();
        let mut values = Vec::with_capacity(self.names.len());
        for channel in 0..MOST_CHANNELS {
            let Some((name, value)) = image.probe(site, detector, channel) else { break };
            // Names and their number are those of the first call.
            if first {
                self.names.push(self.column(&name));
            } else if values.len() == self.names.len() {
                break;
            }
            values.push(f64::from(value));
        }
        if !self.names.is_empty() {
            values.resize(self.names.len(), f64::NAN);
            self.rows.push(Called { call, time, what: values });
        }
    }

    /// Returns a unique, non-empty name of a column for a channel.
    fn column(&self, name: &str) -> String {
        let taken =
            |name: &str| ["t_s", "run"].contains(&name) || self.names.iter().any(|other| other == name);
        let name = if name.is_empty() { "channel" } else { name };
        if !taken(name) {
            return name.to_owned();
        }
        (2..=MOST_CHANNELS + 2).map(|n| format!("{name}_{n}")).find(|other| !taken(other)).unwrap_or_default()
    }
}

#[cfg(test)]
mod column_names {
    use super::*;

    #[test]
    fn law_each_channel_has_a_column_of_its_own() {
        let mut watched = Watched::default();
        let names = ["id", "id", "", "t_s", "run", "id", ""].map(|name| {
            let column = watched.column(name);
            watched.names.push(column.clone());
            column
        });
        assert_eq!(names, ["id", "id_2", "channel", "t_s_2", "run_2", "id_3", "channel_2"]);
    }
}
