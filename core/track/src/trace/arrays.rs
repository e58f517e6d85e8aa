//! The arrays of a step, which are fetched one by one by [`ArrayName`].
//!
//! A name is looked up among the declarations of all stages (`records`).

use std::borrow::Cow;

use serde::{Deserialize, Deserializer, de};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ObjectBuilder, Schema, SchemaType, Type};
use utoipa::{PartialSchema, ToSchema};

use super::StepTrace;
use crate::array_name::ArrayName;
use crate::records;
use sightline_record::{ArrayDecl, ArrayView};

impl StepTrace {
    /// Returns an array of this step; `None` if its stage was not reached.
    pub fn array(&self, name: ArrayName) -> Option<ArrayView<'_>> {
        records::array(self, name.word())
    }
}

impl ArrayName {
    /// All arrays, in the order of the stages.
    pub fn all() -> impl Iterator<Item = Self> {
        records::arrays().map(|array| Self::new(array.name.as_ref()))
    }

    /// Returns the array with this name.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::all().find(|name| name.word() == word)
    }

    /// The declaration of the array.
    pub fn declaration(self) -> Option<&'static ArrayDecl> {
        records::arrays().find(|array| array.name == self.word())
    }
}

impl<'de> Deserialize<'de> for ArrayName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = Cow::<'de, str>::deserialize(deserializer)?;
        Self::from_word(&word).ok_or_else(|| {
            let known: Vec<&str> = Self::all().map(Self::word).collect();
            de::Error::custom(format_args!("unknown array `{word}`, expected one of {}", known.join(", ")))
        })
    }
}

impl PartialSchema for ArrayName {
    fn schema() -> RefOr<Schema> {
        let names = Self::all().map(Self::word);
        let object = ObjectBuilder::new().schema_type(SchemaType::new(Type::String)).enum_values(Some(names));
        object.description(Some("The arrays of a step, in the order of the stages.")).into()
    }
}

impl ToSchema for ArrayName {
    fn name() -> Cow<'static, str> {
        "ArrayName".into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_array_is_read_back_from_its_name_and_no_other_is() {
        for name in ArrayName::all() {
            let text = serde_json::to_string(&name).unwrap();
            assert_eq!(serde_json::from_str::<ArrayName>(&text).unwrap(), name);
            assert_eq!(name.declaration().unwrap().name, name.word());
        }
        let wrong = serde_json::from_str::<ArrayName>("\"picture\"").unwrap_err().to_string();
        assert!(wrong.contains("picture") && wrong.contains("right_window"), "{wrong}");
    }

    #[test]
    fn every_constant_names_a_declared_array() {
        let constants = [
            ArrayName::REFERENCE,
            ArrayName::SCALED,
            ArrayName::ROLLED,
            ArrayName::MATCHED,
            ArrayName::DIFFERENCE,
            ArrayName::SURFACE,
            ArrayName::RIGHT_WINDOW,
            ArrayName::FEATURES,
            ArrayName::CLOUD,
            ArrayName::DISPARITIES,
            ArrayName::RANGES,
            ArrayName::SENSOR,
            ArrayName::ERROR_BEFORE,
            ArrayName::ERROR_COARSE,
            ArrayName::ERROR_FINE,
            ArrayName::COARSE_SEARCH,
            ArrayName::REFINE_PATH,
            ArrayName::MESH_FIXED,
            ArrayName::MESH_MOVING,
            ArrayName::DRAPED,
            ArrayName::DRAPED_MATCH,
        ];
        for name in constants {
            assert!(name.declaration().is_some(), "{name:?}");
        }
    }
}
