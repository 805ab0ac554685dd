//! The page's files, compiled in.

const SCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! assets {
    ($($name:literal: $kind:expr),* $(,)?) => {
        /// The kind and the text of a file of the page; the page itself has no name.
        pub(super) fn find(name: &str) -> Option<(&'static str, &'static str)> {
            match name {
                "" => find("index.html"),
                $($name => Some(($kind, include_str!(concat!("../../page/", $name)))),)*
                _ => None,
            }
        }
    };
}

assets! {
    "index.html": "text/html; charset=utf-8",
    "lab.css": "text/css; charset=utf-8",
    "icon.svg": "image/svg+xml",
    "main.mjs": SCRIPT,
    "engine.mjs": SCRIPT,
    "server.mjs": SCRIPT,
    "decode.mjs": SCRIPT,
    "state.mjs": SCRIPT,
    "controls.mjs": SCRIPT,
    "rotor.mjs": SCRIPT,
    "waves.mjs": SCRIPT,
    "cloud.mjs": SCRIPT,
    "plot.mjs": SCRIPT,
    "folder.mjs": SCRIPT,
    "told.mjs": SCRIPT,
    "words.mjs": SCRIPT,
}
