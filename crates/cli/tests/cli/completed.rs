//! Completion of settings and motors by shells, as their scripts do it.

use std::path::Path;
use std::process::Command;

use super::{folder, standstill};

/// Returns the words that bash would offer for the last of these words, as it breaks them: `=` is a word of its own.
fn offered(words: &[&str]) -> Vec<String> {
    let folder = folder();
    let script = standstill(&["completions", "bash"], folder.path());
    let line = "source ./words; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
        _standstill_or_setting standstill \"${COMP_WORDS[COMP_CWORD]}\" \"${COMP_WORDS[COMP_CWORD - 1]}\" 2>/dev/null
        printf '%s\\n' \"${COMPREPLY[@]}\"";
    std::fs::write(folder.path().join("words"), &script.stdout).expect("written");
    let mut bash = Command::new("bash");
    let bash = bash.args(["-c", line, "bash", "standstill"]).args(words).current_dir(folder.path());
    let output = bash.output().expect("bash");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text").lines().map(str::to_owned).collect()
}

#[test]
fn law_bash_completes_keys_their_values_and_motors() {
    for (words, expected) in [
        (&["run", "-s", "sensors.noi"][..], &["sensors.noise="][..]),
        (&["check", "paper-5k5", "--set", "=", "sensors.noi"], &["sensors.noise="]),
        (&["run", "-s", "detector.method", "=", "bip"], &["bipolar"]),
        (&["run", "--set", "=", "errors", "=", "fi"], &["field"]),
        (&["run", "-s", "errors", "="], &["none", "noise", "default", "harsh", "field"]),
        (&["require", "s.toml", "--key", "sensors.noi"], &["sensors.noise"]),
        (&["tune", "s.toml", "--vary", "detector.thresh"], &["detector.threshold="]),
        (&["check", "pap"], &["paper-5k5"]),
        (&["compare", "--motor", "pap"], &["paper-5k5"]),
        (&["check", "--eff"], &["--effort"]),
        (&["report", "wor"], &[""]),
        // Where no motor fits, bash completes the file by itself.
        (&["run", "wor"], &[""]),
    ] {
        assert_eq!(offered(words), expected, "{words:?}");
    }
}

/// What a shell prints of this command line, if it is installed here.
fn of_shell(shell: &str, arguments: &[&str], at: &Path) -> Option<String> {
    let output = Command::new(shell).args(arguments).current_dir(at).output().ok()?;
    assert!(output.stderr.is_empty(), "{shell}: {}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).expect("text"))
}

#[test]
fn law_zsh_and_fish_have_each_setting_with_its_description() {
    let folder = folder();
    for (shell, noise, method) in [
        ("zsh", "'sensors.noise=:Noise of each sample, rms.'", "'detector.method=bipolar:"),
        ("fish", "'sensors.noise=' 'Noise of each sample, rms.'", "'detector.method=bipolar' '"),
    ] {
        let script = standstill(&["completions", shell], folder.path());
        let script = String::from_utf8(script.stdout).expect("text");
        let settings = script.matches(noise).count();
        assert_eq!((settings, script.matches(method).count()), (1, 1), "{shell}");
        // Each option that sets or varies a key offers settings, each that names one offers keys.
        for (option, offer, least) in [
            ("Set a key of the scenario", "standstill_settings", 15),
            ("Vary a key", "standstill_settings", 3),
            ("The key whose largest or smallest value", "standstill_keys", 1),
        ] {
            let options: Vec<&str> = script.lines().filter(|line| line.contains(option)).collect();
            assert!(options.len() >= least, "{shell}: {option}");
            assert!(options.iter().all(|line| line.contains(offer)), "{shell}: {options:#?}");
        }
        assert!(!script.contains(":KEY=LOW:HIGH:"), "a colon that ends a word");
        std::fs::write(folder.path().join(shell), script).expect("written");
    }
    let at = folder.path();
    of_shell("zsh", &["-n", "zsh"], at);
    for (line, expected) in [
        ("standstill run -s sensors.noi", Some("sensors.noise=\tNoise of each sample, rms.")),
        ("standstill tune s.toml --vary detector.thresh", Some("detector.threshold=\t")),
        ("standstill require s.toml --key sensors.noi", Some("sensors.noise\t")),
        ("standstill compare --motor pap", Some("paper-5k5")),
        ("standstill check pap", Some("paper-5k5")),
        ("standstill report check pap", None),
    ] {
        let Some(offered) = of_shell("fish", &["-c", &format!("source fish; complete -C '{line}'")], at)
        else {
            continue;
        };
        assert!(expected.map_or(offered.is_empty(), |text| offered.contains(text)), "{line}: {offered}");
    }
}
