//! A choice among a few things that have names: each knows its own, so that files and command lines need no list of theirs.

/// A choice among a few things, each with a name as files and command lines write it.
///
/// [`choice!`](crate::choice) makes one from a single list.
pub trait Choice: Copy + PartialEq + Send + Sync + 'static {
    /// Name of the choice, in a word.
    const WHAT: &'static str;
    /// Description of the choice, in a sentence; empty if there is none.
    const ABOUT: &'static str = "";
    /// All that can be chosen.
    const ALL: &'static [Self];
    /// Their names, in the same order.
    const NAMES: &'static [&'static str];

    /// Returns the description of this variant, in a sentence; empty if there is none.
    fn about(self) -> &'static str {
        ""
    }

    /// Returns the name of the variant, as files write it.
    ///
    /// ```
    /// use standstill_interface::{Choice, choice};
    ///
    /// choice! {
    ///     /// A gear.
    ///     pub enum Gear {
    ///         /// Ahead.
    ///         Forward = "forward",
    ///         /// Back.
    ///         Reverse = "reverse",
    ///     }
    /// }
    /// assert_eq!(Gear::Reverse.name(), "reverse");
    /// assert_eq!(Gear::named("forward"), Some(Gear::Forward));
    /// assert_eq!(Gear::named("neutral"), None);
    /// assert_eq!(Gear::Forward.about(), " Ahead.");
    /// ```
    fn name(self) -> &'static str {
        Self::ALL.iter().zip(Self::NAMES).find(|(choice, _)| **choice == self).map_or("", |(_, name)| name)
    }

    /// Returns the variant with this name; none if there is none.
    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().zip(Self::NAMES).find(|(_, known)| **known == name).map(|(choice, _)| *choice)
    }
}

/// Declares an enum whose variants have names, as a [`Choice`](trait@crate::Choice). The variant marked `default` is
/// the `Default` of the enum.
#[macro_export]
macro_rules! choice {
    (
        $(#[doc = $about:literal])+
        $(#[derive($($derive:ident),*)])?
        $(#[serde($($serde:tt)*)])?
        pub enum $name:ident {
            $($(#[doc = $doc:literal])+ $variant:ident = $word:literal $($default:ident)?,)+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq $(, $($derive),*)?)]
        $(#[serde($($serde)*)])?
        pub enum $name {
            $($(#[doc = $doc])+ $(#[$default])? $variant,)+
        }

        impl $name {
            /// All of them.
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$variant),+];

            /// Returns the name in files and on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }
        }

        impl $crate::Choice for $name {
            const WHAT: &'static str = stringify!($name);
            const ABOUT: &'static str = concat!($($about),+);
            const ALL: &'static [Self] = &$name::ALL;
            const NAMES: &'static [&'static str] = &[$($word),+];

            fn about(self) -> &'static str {
                match self {
                    $(Self::$variant => concat!($($doc),+),)+
                }
            }
        }
    };
}
