//! Choices that files write as names.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use standstill_interface::Choice;

/// A value of an enum with named variants. Files contain the name of the variant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Named<T>(pub T);

impl<'de, T: Choice> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = Cow::<str>::deserialize(deserializer)?;
        T::named(&name).map(Self).ok_or_else(|| serde::de::Error::unknown_variant(&name, T::NAMES))
    }
}

impl<T: Choice> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.name())
    }
}

impl<T: Choice> JsonSchema for Named<T> {
    fn schema_name() -> Cow<'static, str> {
        T::WHAT.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let one = |choice: &T| serde_json::json!({ "type": "string", "const": choice.name(), "description": choice.about().trim() });
        let all: Vec<_> = T::ALL.iter().map(one).collect();
        json_schema!({ "description": T::ABOUT.trim(), "oneOf": all })
    }
}

#[cfg(test)]
mod tests {
    use standstill_detect::{MethodName, Signature};
    use standstill_inverter::OpenLeg;
    use standstill_sim::Arrangement;
    use toml::Value;

    use super::*;
    use crate::DesignKind;
    use crate::{ErrorSet, PoleRule, Rotor};

    /// Checks that each name belongs to one variant, and that the schema contains each name. Also checks that reading a name gives its
    /// variant, and that writing a variant gives its name.
    fn check<T: Choice + std::fmt::Debug>() {
        assert_eq!(T::ALL.len(), T::NAMES.len());
        let schema = schemars::schema_for!(Named<T>).to_value();
        for (k, (choice, name)) in T::ALL.iter().zip(T::NAMES).enumerate() {
            assert_eq!(T::named(name), Some(*choice), "{name} twice in {}", T::WHAT);
            let text = Value::from(*name);
            assert_eq!(text.clone().try_into(), Ok(Named(*choice)));
            assert_eq!(Value::try_from(Named(*choice)), Ok(text));
            assert_eq!(schema["oneOf"][k]["const"], *name);
            assert!(!choice.about().is_empty(), "{name}");
        }
        let wrong = Value::from("nonsense").try_into::<Named<T>>().expect_err("no such name").to_string();
        assert!(T::NAMES.iter().all(|name| wrong.contains(name)), "{wrong}");
    }

    #[test]
    fn law_a_choice_is_read_and_written_by_its_name_alone() {
        check::<ErrorSet>();
        check::<Rotor>();
        check::<OpenLeg>();
        check::<Arrangement>();
        check::<MethodName>();
        check::<PoleRule>();
        check::<Signature>();
        check::<DesignKind>();
    }
}
