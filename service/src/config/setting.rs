//! Settings, each defined once: key, type, default, rule and meaning. From that come the keys of
//! the file, the environment and the flags, the checks, and `docs/settings.md`.

use super::ConfigError;

/// A setting of the service, as the documents have it.
#[cfg(test)]
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    /// Its key, with a dot between section and name.
    pub(super) key: &'static str,
    /// What it may be.
    pub(super) rule: &'static str,
    /// What it means, a line each, with its unit in brackets.
    pub(super) doc: &'static [&'static str],
}

/// What a setting may be.
pub(super) struct Rule<T> {
    /// In words, as errors and the documents have it.
    pub(super) words: &'static str,
    /// Whether a value keeps it. NaN keeps none.
    pub(super) holds: fn(&T) -> bool,
    /// A value that breaks it, as errors show it.
    pub(super) shown: fn(&T) -> String,
}

impl<T> Rule<T> {
    /// Checks the value of a setting.
    pub(super) fn check(&self, key: &'static str, value: &T) -> Result<(), ConfigError> {
        if (self.holds)(value) {
            return Ok(());
        }
        Err(ConfigError::Invalid {
            key,
            value: (self.shown)(value),
            rule: self.words,
        })
    }
}

/// The rule that the type itself is.
pub(super) const fn any<T>(words: &'static str) -> Rule<T> {
    Rule {
        words,
        holds: |_| true,
        shown: |_| String::new(),
    }
}

/// The rule of counts.
pub(super) const COUNT: Rule<usize> = Rule {
    words: "1 to 1000000",
    holds: |count| (1..=1_000_000).contains(count),
    shown: usize::to_string,
};

/// The rule of times that a timer waits for: a day at most.
pub(super) const INTERVAL_S: Rule<f64> = Rule {
    words: "0.001 to 86400 seconds",
    holds: |time_s| (0.001..=86_400.0).contains(time_s),
    shown: f64::to_string,
};

/// Defines a section of settings: a struct with its defaults, the list of its settings, and the
/// check of each value by itself.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        pub struct $config:ident of $section:literal {
            $(
                $(#[doc = $doc:literal])+
                $(#[serde($serde:meta)])?
                $name:ident: $kind:ty = $default:expr, $rule:expr;
            )+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $config {
            $(
                $(#[doc = $doc])+
                $(#[serde($serde)])?
                pub $name: $kind,
            )+
        }

        impl Default for $config {
            fn default() -> Self {
                Self { $($name: $default,)+ }
            }
        }

        impl $config {
            /// The settings, in the order of the file.
            #[cfg(test)]
            pub(super) const SETTINGS: &[crate::config::setting::Setting] = &[
                $(crate::config::setting::Setting {
                    key: concat!($section, ".", stringify!($name)),
                    rule: {
                        const RULE: crate::config::setting::Rule<$kind> = $rule;
                        RULE.words
                    },
                    doc: &[$($doc),+],
                },)+
            ];

            /// Checks each value by itself.
            fn check_values(&self) -> Result<(), crate::config::ConfigError> {
                $($rule.check(concat!($section, ".", stringify!($name)), &self.$name)?;)+
                Ok(())
            }
        }
    };
}
pub(super) use section;
