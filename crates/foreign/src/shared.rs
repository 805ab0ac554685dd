//! What a library takes from elsewhere that keeps something between calls: there is one of it for all copies of the library.

use crate::elf::Elf;

/// Functions of the C library that keep something for the next call, on which records then depend.
const KEEPS: [&str; 23] = [
    "asctime",
    "ctime",
    "drand48",
    "erand48",
    "getenv",
    "gmtime",
    "jrand48",
    "lcong48",
    "localtime",
    "lrand48",
    "mrand48",
    "nrand48",
    "rand",
    "random",
    "seed48",
    "setenv",
    "setlocale",
    "setstate",
    "srand",
    "srand48",
    "srandom",
    "strtok",
    "tmpnam",
];

/// Libraries of the system itself: what they keep is above.
const SYSTEM: [&str; 10] = [
    "libc.",
    "libm.",
    "libgcc_s.",
    "libstdc++.",
    "libpthread.",
    "libdl.",
    "librt.",
    "ld-linux",
    "libc++.",
    "libmvec.",
];

/// What a library shares with its copies; nothing if it is only what keeps nothing.
pub fn note(elf: &Elf) -> Option<String> {
    let keeps: Vec<&str> =
        elf.undefined.iter().map(String::as_str).filter(|name| KEEPS.contains(name)).collect();
    let linked = elf.needed.iter().map(String::as_str);
    let linked: Vec<&str> =
        linked.filter(|name| !SYSTEM.iter().any(|system| name.starts_with(system))).collect();
    let what = match (keeps.is_empty(), linked.is_empty()) {
        (true, true) => return None,
        (false, true) => format!("calls {}", keeps.join(", ")),
        (true, false) => format!("is linked to {}", linked.join(", ")),
        (false, false) => format!("calls {} and is linked to {}", keeps.join(", "), linked.join(", ")),
    };
    Some(format!(
        "it {what}: what these keep is there once for all copies of the library and is not set back, so that results may depend \
         on the number of threads"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_what_keeps_something_outside_of_the_library_is_named() {
        let elf = |undefined: &[&str], needed: &[&str]| Elf {
            undefined: undefined.iter().map(ToString::to_string).collect(),
            needed: needed.iter().map(ToString::to_string).collect(),
            ..Elf::default()
        };
        assert_eq!(
            note(&elf(&["sinf", "malloc"], &["libm.so.6", "libc.so.6", "ld-linux-x86-64.so.2"])),
            None
        );
        let calls = note(&elf(&["rand", "sinf", "strtok"], &["libc.so.6"])).expect("keeps");
        assert!(calls.contains("it calls rand, strtok: "), "{calls}");
        let linked = note(&elf(&[], &["libc.so.6", "libmotor.so.3"])).expect("keeps");
        assert!(linked.contains("it is linked to libmotor.so.3: "), "{linked}");
    }
}
