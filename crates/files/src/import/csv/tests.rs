use std::fmt::Write as _;

use super::*;

fn read_plain(text: &str) -> Result<MapSamples, MapError> {
    read("m.csv", text.as_bytes(), &MapLayout::default())
}

/// A map of a motor that saturates.
fn psi(d: f64, q: f64) -> [f64; 2] {
    [0.45 + 0.0106 * d - 2e-5 * d * d - 4e-5 * q * q, 0.0169 * q - 8e-5 * d * q]
}

fn close(samples: &MapSamples, within: f64) {
    for p in &samples.points {
        let [psi_d, psi_q] = psi(p.i_d, p.i_q);
        assert!((p.psi_d - psi_d).abs() < within && (p.psi_q - psi_q).abs() < within, "{p:?}");
    }
}

#[test]
fn regress_a_line_without_an_end_is_no_name_of_a_column() {
    for text in
        ["\0".repeat(20 << 20), "1,".repeat(10 << 20), format!("i_d_A,i_q_A\n{}", "7".repeat(20 << 20))]
    {
        let message = read_plain(&text).expect_err("must be refused").to_string();
        assert!(
            message.contains("found a line of more than 1 MiB; needed: at most 1 MiB in a line"),
            "{message}"
        );
    }
}

#[test]
fn regress_csv_is_read_in_any_order_and_its_faults_are_named() {
    let text =
        "\u{feff}psi_d_Wb, i_d_A,i_q_A,psi_q_Wb\r\n# measured\r\n0.45,-1,2,0.03\r\n\r\n0.5, 1,2,0.04\r\n";
    let samples = read_plain(text).expect("a map");
    assert_eq!(samples.points.len(), 2);
    let first = MapPoint { i_d: -1.0, i_q: 2.0, psi_d: 0.45, psi_q: 0.03, place: Place::Line(3) };
    assert_eq!(samples.points[0], first);
    assert_eq!(samples.points[1].place, Place::Line(5));
    let header = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n";
    for (text, expected) in [
        (format!("{header}0,0,NaN,0\n"), "m.csv: line 2: found psi_d_Wb = `NaN`; needed: a finite number"),
        (format!("{header}0,0,1\n"), "m.csv: line 2: found 3 field(s) in `0,0,1`; needed: 4"),
        (format!("{header}0,0,x,0\n"), "psi_d_Wb = `x`"),
        (header.to_owned(), "no point"),
        (String::new(), "an empty file; needed: a header"),
        ("i_d_H,i_q_A,psi_d_Wb,psi_q_Wb\n".to_owned(), "the column `i_d_H`; needed: one of the units A, mA"),
        ("i_d_A,i_q_A,i_q_A,psi_d_Wb,psi_q_Wb\n".to_owned(), "`i_q_A` twice"),
        ("i_d_A,i_q_A,psi_d_Wb\n".to_owned(), "a header of 3 column(s): `i_d_A,i_q_A,psi_d_Wb`"),
        ("a,b,c,d,e\n".to_owned(), "standstill magnetics m.csv --columns i_d_A,i_q_A,psi_d_Wb,psi_q_Wb,-"),
        ("1,2,3,4\n".to_owned(), "numbers without a header of 4 column(s)"),
        (
            "Id [Arms],Iq [Arms],psi_d_Wb,psi_q_Wb\n".to_owned(),
            "`Id [Arms]`, which says rms; needed: `--values rms`",
        ),
        ("i_A,angle_from_d,psi_d_Wb,psi_q_Wb\n".to_owned(), "one of the units deg"),
    ] {
        let error = read_plain(&text).expect_err("must be refused").to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn cross_other_peoples_headers_separators_and_units_are_read() {
    let long = |header: &str, line: &dyn Fn([f64; 4]) -> String| {
        let mut text = format!("{header}\n");
        for d in -3..=3 {
            for q in -2..=2 {
                let (d, q) = (f64::from(d), f64::from(q));
                let [psi_d, psi_q] = psi(d, q);
                let _ = writeln!(text, "{}", line([d, q, psi_d, psi_q]));
            }
        }
        text
    };
    for text in [
        long("id_A,iq_A,psi_d_Vs,psi_q_Vs,T_Nm", &|[d, q, x, y]| format!("{d},{q},{x},{y},7")),
        long("Flux d [mWb]\tId [A]\tFlux q [mWb]\tIq [mA]", &|[d, q, x, y]| {
            format!("{}\t{d}\t{}\t{}", 1e3 * x, 1e3 * y, 1e3 * q)
        }),
        long("Id (A);Iq (A);λ_d [V·s];λ_q [V·s]", &|v| {
            v.map(|x| x.to_string().replace('.', ",")).join(";")
        }),
        long("id iq fd fq", &|v| v.map(|x| format!("  {x:e}")).concat()),
    ] {
        let samples = read_plain(&text).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(samples.points.len(), 35);
        close(&samples, 1e-12);
    }
    // Without a header, and by what is said of it.
    let text = long("", &|[d, q, x, y]| format!("{x},9,{y},{q},{d}"));
    let layout =
        MapLayout { columns: Some("psi_d_Wb,-,psi_q_Wb,i_q_A,i_d_A".to_owned()), ..MapLayout::default() };
    let samples = read("m.csv", text.as_bytes(), &layout).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(samples.points.len(), 35);
    close(&samples, 1e-12);
}

#[test]
fn cross_wide_tables_are_read_either_way_round() {
    let (d, q) = ([-4.0, -2.0, 0.0, 2.0, 4.0], [-3.0, 0.0, 3.0]);
    let block = |lines: &[f64], columns: &[f64], corner: &str, value: &dyn Fn(f64, f64) -> f64| {
        let join = |values: Vec<String>| values.join(";");
        let mut text = format!("{corner};{}\n", join(columns.iter().map(ToString::to_string).collect()));
        for line in lines {
            let values = join(columns.iter().map(|c| value(*line, *c).to_string()).collect());
            let _ = writeln!(text, "{line};{values}");
        }
        text
    };
    let one = block(&d, &q, r"psi_d_Wb: i_d_A\i_q_A", &|d, q| psi(d, q)[0])
        + &block(&d, &q, r"psi_q_Wb: i_d_A\i_q_A", &|d, q| psi(d, q)[1]);
    let other = "Flux d [mWb]\n".to_owned()
        + &block(&q, &d, r"Iq [A]\Id [A]", &|q, d| 1e3 * psi(d, q)[0])
        + "Flux q [mWb];;;;;\n"
        + &block(&d, &q, r"Id [A]\Iq [A]", &|d, q| 1e3 * psi(d, q)[1]);
    for text in [&one, &other] {
        let samples = read_plain(text).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(samples.points.len(), 15);
        close(&samples, 1e-12);
    }
    for (text, expected) in [
        (one.lines().take(6).collect::<Vec<_>>().join("\n"), "15 points of psi_d and 0 of psi_q"),
        (one.replacen("psi_d_Wb: ", "", 1), "a block without its flux"),
        (one.replacen(r"i_d_A\i_q_A", r"i_d_A\i_d_A", 1), "in the corner of a block"),
        (one.replacen("-4;", "-4;1;", 1), "5 field(s)"),
    ] {
        let error = read_plain(&text).expect_err("must be refused").to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn cross_polar_maps_become_rectangles() {
    for (header, turn, ends) in [
        ("i_A,angle_from_d_deg,psi_d_Wb,psi_q_Wb", 0.0, [-180, 170]),
        ("i_A,angle_from_q_deg,psi_d_Wb,psi_q_Wb", 90.0, [0, 90]),
        ("psi_d_Wb,psi_q_Wb,Is [A],angle_from_q [deg]", 90.0, [-90, 90]),
    ] {
        let mut text = format!("{header}\n");
        for amplitude in 0..=12 {
            for angle in (ends[0]..=ends[1]).step_by(10) {
                let (i, angle) = (f64::from(amplitude), f64::from(angle));
                let (sin, cos) = (angle + turn).to_radians().sin_cos();
                let [x, y] = psi(i * cos, i * sin);
                let line = if header.starts_with('i') {
                    format!("{i},{angle},{x},{y}")
                } else {
                    format!("{x},{y},{i},{angle}")
                };
                let _ = writeln!(text, "{line}");
            }
        }
        let samples = read_plain(&text).unwrap_or_else(|error| panic!("{error}"));
        close(&samples, 2e-5);
        let range = |of: fn(&MapPoint) -> f64| {
            let values = samples.points.iter().map(of);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        let side = 12.0 * std::f64::consts::FRAC_1_SQRT_2;
        let (d, q) = (range(|p| p.i_d), range(|p| p.i_q));
        let whole = ends[1] - ends[0] > 300;
        let expected_d = [-side, if whole || ends[0] < 0 { side } else { 0.0 }];
        let expected_q = [if whole { -side } else { 0.0 }, side];
        for (got, expected) in d.iter().chain(&q).zip(expected_d.iter().chain(&expected_q)) {
            assert!((got - expected).abs() < 1e-9, "{header}: {d:?} {q:?}");
        }
    }
}
