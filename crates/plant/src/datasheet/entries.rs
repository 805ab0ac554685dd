//! A data sheet's numbers, ready to print.

use standstill_files::sheet::{Entry, Sheet};

use super::{DataSheet, nameplate};

impl DataSheet {
    /// Returns each number with its source, in the order of the file.
    pub fn entries(&self) -> Vec<Entry> {
        let Sheet { rating, winding, map, saturation, bridge, rotor, .. } = &self.tables;
        let Sheet { nameplate, harmonics, eddy, hysteresis, thermal, .. } = &self.tables;
        let mut all = match nameplate {
            Some(nameplate) => nameplate::entries(nameplate),
            None => [rating.entries("rating"), winding.entries("winding")].concat(),
        };
        all.extend(map.iter().map(|map| {
            let ((source, reason), value) = (map.file.source(), map.file.name().to_owned());
            Entry { key: "map.file".to_owned(), value, source, reason: reason.to_owned() }
        }));
        all.extend(saturation.iter().flat_map(|table| table.entries("saturation")));
        all.extend(bridge.iter().flat_map(|table| table.entries("bridge")));
        all.extend(rotor.entries("rotor"));
        all.extend(harmonics.iter().flat_map(|table| table.entries("harmonics")));
        all.extend(eddy.iter().flat_map(|table| table.entries("eddy")));
        all.extend(hysteresis.iter().flat_map(|table| table.entries("hysteresis")));
        all.extend(thermal.iter().flat_map(|table| table.entries("thermal")));
        all
    }
}
