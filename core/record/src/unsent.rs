//! Values of a record that are never serialised: arrays, which are fetched one by one by their names.

use super::ArrayView;

/// A value that exists only in the process that computed the record; absent in a record that was read from JSON.
///
/// A field of this type is marked `#[serde(skip)]`. Every reader gets an `Option`, so that an array which was not sent
/// cannot be taken for an empty one.
#[derive(Clone, Debug, PartialEq)]
pub struct Unsent<T>(Option<T>);

impl<T> Unsent<T> {
    /// The value; `None` if the record was read from JSON, or the value was not computed.
    pub const fn get(&self) -> Option<&T> {
        self.0.as_ref()
    }

    /// The view of an array; empty, which means missing, if the array is absent.
    pub fn view<'a>(&'a self) -> ArrayView<'a>
    where
        &'a T: Into<ArrayView<'a>>,
    {
        self.get().map_or(ArrayView::new(0, &[]), Into::into)
    }
}

impl<T: Default> Unsent<T> {
    /// A mutable reference to the value; inserts the default if it is absent.
    pub fn get_or_default(&mut self) -> &mut T {
        self.0.get_or_insert_default()
    }
}

impl<T> Default for Unsent<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> From<T> for Unsent<T> {
    fn from(value: T) -> Self {
        Self(Some(value))
    }
}

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    use super::*;

    #[derive(Debug, Default, Serialize, Deserialize)]
    struct Found {
        score: f64,
        #[serde(skip)]
        scores: Unsent<Vec<f32>>,
    }

    #[test]
    fn a_value_is_absent_after_the_record_is_read_from_json() {
        let found = Found { score: 0.5, scores: vec![0.25].into() };
        let text = serde_json::to_string(&found).unwrap();
        assert_eq!(text, "{\"score\":0.5}");
        let read: Found = serde_json::from_str(&text).unwrap();
        assert_eq!((found.scores.get(), read.scores.get()), (Some(&vec![0.25]), None));
        assert_eq!(read.score, 0.5);
    }

    #[test]
    fn an_absent_value_is_an_empty_view_which_counts_as_missing() {
        let absent = Unsent::<sightline_vision::image::patch::Patch>::default();
        assert!(absent.view().is_empty());
    }
}
