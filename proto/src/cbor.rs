//! The CBOR reader: ciborium, held to what other languages write and to what was declared.
//!
//! Other languages' encoders write the number 1.0 as the integer 1 (JavaScript has no other
//! numbers), which ciborium refuses where a float is declared. And ciborium does not look whether
//! an array or map had more items than the reader took: the rest would be read as what follows it.
//! So every value passes through [`Strict`], which takes an integer for a float, and refuses items
//! left over and enum variants that are not a text or a map of one entry.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{
    Deserialize, DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error, IgnoredAny,
    IntoDeserializer, MapAccess, SeqAccess, Visitor,
};
use serde_path_to_error::Path;

use crate::field;

/// Deepest nesting: messages stay below ten, so this leaves room for fields that nobody knows, and
/// stays far from the end of a thread's stack.
const NESTING_MAX: usize = 128;

/// Reads one message.
///
/// # Errors
/// Says why the bytes are not exactly one such message.
pub(crate) fn from_slice<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let mut rest = bytes;
    let Message(message) =
        ciborium::de::from_reader_with_recursion_limit(&mut rest, NESTING_MAX).map_err(explain)?;
    if rest.is_empty() {
        Ok(message)
    } else {
        Err(format!("{} bytes after the message", rest.len()))
    }
}

/// The field for which the bytes are no such message, if it is for one.
pub(crate) fn refused_field<T: DeserializeOwned>(bytes: &[u8]) -> Option<Path> {
    let found = ciborium::de::from_reader_with_recursion_limit(bytes, NESTING_MAX);
    found.ok().and_then(|Refused::<T>(path, _)| path)
}

/// The field for which a message cannot be read, in place of the message.
struct Refused<T>(Option<Path>, PhantomData<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Refused<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let path = field::refused::<T, _>(Strict(deserializer));
        Ok(Self(path, PhantomData))
    }
}

fn explain<Io>(error: ciborium::de::Error<Io>) -> String {
    use ciborium::de::Error as E;
    match error {
        E::Io(_) => "the bytes end within the message".to_owned(),
        E::Syntax(at) => format!("not CBOR at byte {at}"),
        E::Semantic(Some(at), text) => format!("{text} at byte {at}"),
        E::Semantic(None, text) => text,
        E::RecursionLimitExceeded => format!("nested more than {NESTING_MAX} deep"),
    }
}

/// A message read through [`Strict`].
struct Message<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Message<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        T::deserialize(Strict(deserializer)).map(Message)
    }
}

/// A deserializer, seed or visitor whose whole inside is read strictly.
struct Strict<T>(T);

/// Passes deserializer methods on.
macro_rules! forward_deserialize {
    ($($method:ident($($argument:ident: $kind:ty),*);)*) => {$(
        fn $method<V: Visitor<'de>>(
            self,
            $($argument: $kind,)*
            visitor: V,
        ) -> Result<V::Value, D::Error> {
            self.0.$method($($argument,)* Strict(visitor))
        }
    )*};
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Strict<D> {
    type Error = D::Error;

    forward_deserialize! {
        deserialize_any();
        deserialize_bool();
        deserialize_i8();
        deserialize_i16();
        deserialize_i32();
        deserialize_i64();
        deserialize_i128();
        deserialize_u8();
        deserialize_u16();
        deserialize_u32();
        deserialize_u64();
        deserialize_u128();
        deserialize_char();
        deserialize_str();
        deserialize_string();
        deserialize_bytes();
        deserialize_byte_buf();
        deserialize_option();
        deserialize_unit();
        deserialize_unit_struct(name: &'static str);
        deserialize_newtype_struct(name: &'static str);
        deserialize_seq();
        deserialize_tuple(len: usize);
        deserialize_tuple_struct(name: &'static str, len: usize);
        deserialize_map();
        deserialize_struct(name: &'static str, fields: &'static [&'static str]);
        deserialize_identifier();
        deserialize_ignored_any();
    }

    // Visitors of floats take integers too, when the deserializer hands them over.
    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.0.deserialize_any(visitor)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.0.deserialize_any(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_any(Variant(visitor))
    }

    fn is_human_readable(&self) -> bool {
        self.0.is_human_readable()
    }
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for Strict<S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<S::Value, D::Error> {
        self.0.deserialize(Strict(deserializer))
    }
}

/// Passes visitor methods of plain values on.
macro_rules! forward_visit {
    ($($method:ident($kind:ty);)*) => {$(
        fn $method<E: Error>(self, value: $kind) -> Result<V::Value, E> {
            self.0.$method(value)
        }
    )*};
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Strict<V> {
    type Value = V::Value;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.expecting(formatter)
    }

    forward_visit! {
        visit_bool(bool);
        visit_i64(i64);
        visit_i128(i128);
        visit_u64(u64);
        visit_u128(u128);
        visit_f64(f64);
        visit_char(char);
        visit_str(&str);
        visit_string(String);
        visit_bytes(&[u8]);
        visit_byte_buf(Vec<u8>);
    }

    fn visit_none<E: Error>(self) -> Result<V::Value, E> {
        self.0.visit_none()
    }

    fn visit_unit<E: Error>(self) -> Result<V::Value, E> {
        self.0.visit_unit()
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<V::Value, D::Error> {
        self.0.visit_some(Strict(deserializer))
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(
        self,
        deserializer: D,
    ) -> Result<V::Value, D::Error> {
        self.0.visit_newtype_struct(Strict(deserializer))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<V::Value, A::Error> {
        let mut items = Items::new(seq);
        let value = self.0.visit_seq(&mut items)?;
        match items.next_element::<IgnoredAny>()? {
            None => Ok(value),
            Some(_) => Err(A::Error::custom("an array has more items than it should")),
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<V::Value, A::Error> {
        let mut items = Items::new(map);
        let value = self.0.visit_map(&mut items)?;
        match items.next_key::<IgnoredAny>()? {
            None => Ok(value),
            Some(_) => Err(A::Error::custom("a map has more entries than it should")),
        }
    }

    // Only tags arrive here, on values that nobody asked for.
    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<V::Value, A::Error> {
        self.0.visit_enum(data)
    }
}

/// The visitor of an enum: the text of its variant, or a map from it to its contents.
struct Variant<V>(V);

impl<'de, V: Visitor<'de>> Visitor<'de> for Variant<V> {
    type Value = V::Value;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.expecting(formatter)
    }

    fn visit_str<E: Error>(self, variant: &str) -> Result<V::Value, E> {
        self.0.visit_enum(variant.into_deserializer())
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<V::Value, A::Error> {
        let mut items = Items::new(map);
        let value = self.0.visit_enum(MapAccessDeserializer::new(&mut items))?;
        match items.next_key::<IgnoredAny>()? {
            None => Ok(value),
            Some(_) => Err(A::Error::custom("an enum has one variant, not several")),
        }
    }
}

/// The items of an array or a map. It remembers the end, because ciborium reads on if it is asked
/// again after the end of an array or map of undeclared length.
struct Items<A> {
    access: A,
    ended: bool,
}

impl<A> Items<A> {
    fn new(access: A) -> Self {
        Self {
            access,
            ended: false,
        }
    }
}

impl<'de, A: SeqAccess<'de>> SeqAccess<'de> for Items<A> {
    type Error = A::Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, A::Error> {
        if self.ended {
            return Ok(None);
        }
        let element = self.access.next_element_seed(Strict(seed))?;
        self.ended = element.is_none();
        Ok(element)
    }

    fn size_hint(&self) -> Option<usize> {
        self.access.size_hint()
    }
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Items<A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, A::Error> {
        if self.ended {
            return Ok(None);
        }
        let key = self.access.next_key_seed(Strict(seed))?;
        self.ended = key.is_none();
        Ok(key)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.access.next_value_seed(Strict(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.access.size_hint()
    }
}
