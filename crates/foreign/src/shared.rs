//! Functions with state between calls that a library takes from elsewhere: those that it cannot have to itself are refused, or named.

use std::path::PathBuf;

use crate::library::LoadError;
use crate::parts::Part;

/// Functions of the C library with state that is kept between calls and that images share.
const KEEPS: &str = "\
    asctime bindtextdomain ctime dlmopen getenv getopt getopt_long gmtime initstate lcong48 localtime mmap mmap64 on_exit putenv \
    sbrk seed48 setenv setstate sigaction signal tmpnam unsetenv uselocale _ZNSt6locale6globalERKS_";

/// Functions that open files, and beginnings of those of C++.
const OPENS: &str = "\
    creat creat64 fopen fopen64 freopen mkstemp open open64 openat popen shm_open socket tmpfile tmpfile64";
const OPENS_BY: [&str; 2] = ["_ZNSt13basic_filebuf", "_ZNSt14basic_ifstream"];

/// Functions whose answers are others each time.
const CHANGES: &str = "\
    arc4random clock clock_gettime getentropy getpid getrandom gettimeofday time timespec_get times";
const CHANGES_BY: [&str; 2] = ["_ZNSt13random_device", "_ZNSt6chrono3_V2"];

/// Functions that begin a thread or a process.
const RUNS: &str = "\
    clone execv execve execvp fork posix_spawn posix_spawnp pthread_create pthread_key_create system thrd_create vfork";
const RUNS_BY: [&str; 2] = ["_ZNSt6thread15_M_start_thread", "GOMP_parallel"];

/// Functions that allocate lasting memory in the C library and have no replacement in an image. Such memory is not
/// restored together with the variables that point to it.
const ALLOCATES: &str = "\
    __asprintf_chk __vasprintf_chk asprintf glob hcreate iconv_open newlocale open_memstream open_wmemstream opendir regcomp scandir \
    tsearch vasprintf wordexp";

/// Returns the names of a list (parted by blanks), or with one of these prefixes, that parts of the image take from elsewhere.
fn taken<'a>(parts: &'a [Part], names: &str, beginnings: &[&str]) -> Vec<&'a str> {
    // Weak names that a relocation uses are called as others are.
    let of = |part: &'a Part| {
        let used = part.elf.taken.iter().map(|(_, name)| name.as_str());
        part.elf.undefined.iter().map(String::as_str).chain(used)
    };
    let listed = |name: &str| names.split_ascii_whitespace().any(|listed| listed == name);
    let is = |name: &&str| listed(name) || beginnings.iter().any(|begin| name.starts_with(begin));
    let mut all: Vec<&str> = parts.iter().filter(|part| part.is_of_run).flat_map(of).filter(is).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Returns whether the compiler's AddressSanitizer is in one of them.
pub fn is_checked(parts: &[Part]) -> bool {
    !taken(parts, "__asan_init", &[]).is_empty()
}

/// Returns whether a list of libraries has one whose file's name has this part.
fn named(list: &str, part: &str) -> bool {
    list.split([':', ' ']).any(|path| path.rsplit('/').next().is_some_and(|name| name.contains(part)))
}

/// Returns the program that checks memory, such as a sanitizer, if `LD_PRELOAD` contains its library; none otherwise.
fn checker() -> Option<&'static str> {
    let first = std::env::var("LD_PRELOAD").unwrap_or_default();
    [("vgpreload", "valgrind"), ("asan", "AddressSanitizer")]
        .into_iter()
        .find_map(|(part, name)| named(&first, part).then_some(name))
}

/// Returns true if images have separate memory for `malloc`; a program that checks memory must see all allocations, so
/// images then use the common one.
pub fn keeps_its_own(parts: &[Part]) -> bool {
    !is_checked(parts) && checker().is_none()
}

/// Refuses libraries whose state cannot be restored.
///
/// # Errors
/// The library has its own threads or processes, or was compiled with checks that this program lacks.
pub fn check(parts: &[Part]) -> Result<(), LoadError> {
    let runs = taken(parts, RUNS, &RUNS_BY);
    if !runs.is_empty() {
        return Err(LoadError::new(
            format!("a library with threads or processes of its own ({})", runs.join(", ")),
            "one that does its work within the call: stub what begins them".to_owned(),
        ));
    }
    let allocates = taken(parts, ALLOCATES, &[]);
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    let allocates: Vec<_> =
        allocates.into_iter().filter(|name| crate::strings::in_place_of(name).is_none()).collect();
    if !allocates.is_empty() && keeps_its_own(parts) {
        return Err(LoadError::new(
            format!("a library with memory that the C library allocates ({})", allocates.join(", ")),
            "one that allocates by malloc or writes into buffers of its own (snprintf, fgets): only these are set back"
                .to_owned(),
        ));
    }
    if is_checked(parts) && checker().is_none() {
        return Err(LoadError::new(
            "a library that was compiled with -fsanitize=address".to_owned(),
            "AddressSanitizer in the program too: LD_PRELOAD=$(cc -print-file-name=libasan.so) standstill …"
                .to_owned(),
        ));
    }
    Ok(())
}

/// Returns the remark on results with a library of these parts, which has loaded the libraries `loads` itself; none if all of its
/// state is set back.
pub fn note(parts: &[Part], loads: &[PathBuf]) -> Option<String> {
    const SHARED: &str = "is there once for all copies of the library and is not set back, so that results may depend on the \
                          number of threads";
    let mut said = Vec::new();
    let keeps = taken(parts, KEEPS, &[]);
    if !keeps.is_empty() {
        said.push(format!("it calls {}: what these keep {SHARED}", keeps.join(", ")));
    }
    if !loads.is_empty() {
        let names: Vec<String> = loads.iter().map(|path| path.display().to_string()).collect();
        said.push(format!("it loads {}: what these keep {SHARED}", names.join(", ")));
    }
    let opens = taken(parts, OPENS, &OPENS_BY);
    if !opens.is_empty() {
        said.push(format!(
            "it opens files ({}): where it stands in one is not set back, and its content is not part of the run, so that results \
             may depend on the number of threads and on what was there",
            opens.join(", ")
        ));
    }
    let changes = taken(parts, CHANGES, &CHANGES_BY);
    if !changes.is_empty() {
        said.push(format!("it calls {}: its trials cannot be repeated", changes.join(", ")));
    }
    if let Some(checker) = checker() {
        said.push(format!("what malloc gives is left to {checker} and is not set back"));
    }
    (!said.is_empty()).then(|| said.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::Elf;

    fn part(undefined: &[&str]) -> Part {
        Part {
            path: "mine.so".into(),
            bytes: Vec::new().into(),
            elf: Elf { undefined: undefined.iter().map(ToString::to_string).collect(), ..Elf::default() },
            name: None,
            is_of_run: true,
        }
    }

    #[test]
    fn law_what_keeps_something_outside_of_the_library_is_named() {
        let of = |undefined: &[&str]| note(&[part(&[]), part(undefined)], &[]);
        assert_eq!(of(&["sinf", "malloc", "rand", "strtok", "setlocale", "printf"]), None);
        let calls = of(&["localtime", "sinf", "ctime"]).expect("keeps");
        assert!(calls.contains("it calls ctime, localtime: what these keep"), "{calls}");
        let opens = of(&["fopen", "time"]).expect("keeps");
        assert!(opens.contains("opens files (fopen): ") && opens.contains("it calls time: "), "{opens}");
        let loads = note(&[part(&[])], &["/opt/plug.so".into()]).expect("keeps");
        assert!(loads.contains("it loads /opt/plug.so: "), "{loads}");
        // A compiler's library has much that nobody calls.
        let compilers = [Part { is_of_run: false, ..part(&["fopen", "pthread_create"]) }];
        assert!(note(&compilers, &[]).is_none() && check(&compilers).is_ok());
    }

    #[test]
    fn law_what_cannot_be_set_back_is_refused() {
        for (name, part_of) in [
            ("pthread_create", "(pthread_create)"),
            ("_ZNSt6thread15_M_start_threadESt10unique_ptr", "threads"),
            ("__asan_init", "-fsanitize=address"),
            ("open_memstream", "(open_memstream)"),
        ] {
            let error = check(&[part(&[name])]).expect_err("refused").to_string();
            assert!(error.contains(part_of), "{error}");
        }
    }
}
