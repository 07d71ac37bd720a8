//! A value that may be written in two ways: by itself, or as a list. An error inside a list names
//! its place in the list.

use std::fmt;
use std::marker::PhantomData;
use std::path::PathBuf;

use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, IntoDeserializer, SeqAccess, Unexpected, Visitor};

/// One value, or a list of values.
pub(crate) enum OneOr<One, List> {
    One(One),
    List(List),
}

/// A value that may be written in place of a list.
pub(crate) trait One<'de>: Deserialize<'de> {
    /// Both ways to write the value, for error messages.
    const EITHER: &'static str;
}

impl One<'_> for String {
    const EITHER: &'static str = "the name of a preset, or a list";
}

impl One<'_> for PathBuf {
    const EITHER: &'static str = "a path, or a list of paths";
}

impl One<'_> for f64 {
    const EITHER: &'static str = "a number, or three";
}

impl<'de, A: One<'de>, L: Deserialize<'de>> Deserialize<'de> for OneOr<A, L> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Either(PhantomData))
    }
}

struct Either<A, L>(PhantomData<(A, L)>);

impl<'de, A: One<'de>, L: Deserialize<'de>> Either<A, L> {
    fn one<E: Error>(
        self,
        value: impl IntoDeserializer<'de, E>,
        found: Unexpected<'_>,
    ) -> Result<OneOr<A, L>, E> {
        A::deserialize(value.into_deserializer()).map(OneOr::One).map_err(|_| E::invalid_type(found, &self))
    }
}

impl<'de, A: One<'de>, L: Deserialize<'de>> Visitor<'de> for Either<A, L> {
    type Value = OneOr<A, L>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(A::EITHER)
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        self.one(name.to_owned(), Unexpected::Str(name))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
        self.one(number, Unexpected::Float(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
        self.one(number, Unexpected::Signed(number))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
        self.one(number, Unexpected::Unsigned(number))
    }

    fn visit_seq<S: SeqAccess<'de>>(self, list: S) -> Result<Self::Value, S::Error> {
        L::deserialize(SeqAccessDeserializer::new(list)).map(OneOr::List)
    }
}
