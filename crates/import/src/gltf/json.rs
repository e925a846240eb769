//! A JSON tree that borrows its strings from the file and refuses an object with the same key twice.

use serde::de::{self, Deserialize, DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};
use std::borrow::Cow;
use std::cell::Cell;
use std::fmt;

/// Most values that one document may hold; at 32 bytes each this bounds the tree's memory.
const MAX_VALUES: usize = 48 << 20;

/// A JSON value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Json<'a> {
    Null,
    Bool(bool),
    Number(f64),
    String(Cow<'a, str>),
    Array(Vec<Json<'a>>),
    Object(Vec<(Cow<'a, str>, Json<'a>)>),
}

static NULL: Json<'static> = Json::Null;

/// Parses a document.
///
/// # Errors
/// Whatever `serde_json` finds, and double keys, with line and column.
pub(super) fn parse(bytes: &[u8]) -> Result<Json<'_>, serde_json::Error> {
    let values = Cell::new(0);
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let json = Seed { values: &values }.deserialize(&mut deserializer)?;
    deserializer.end()?;
    Ok(json)
}

impl<'a> Json<'a> {
    /// A copy that does not borrow from the text.
    pub(super) fn owned(&self) -> Json<'static> {
        let text = |text: &Cow<'a, str>| Cow::Owned(text.clone().into_owned());
        match self {
            Json::Null => Json::Null,
            Json::Bool(flag) => Json::Bool(*flag),
            Json::Number(x) => Json::Number(*x),
            Json::String(s) => Json::String(text(s)),
            Json::Array(list) => Json::Array(list.iter().map(Json::owned).collect()),
            Json::Object(members) => {
                Json::Object(members.iter().map(|(key, value)| (text(key), value.owned())).collect())
            }
        }
    }

    /// The member of that name; null if there is none, or if this is no object.
    pub(super) fn at(&self, key: &str) -> &Json<'a> {
        self.get(key).unwrap_or(&NULL)
    }

    /// The member of that name.
    pub(super) fn get(&self, key: &str) -> Option<&Json<'a>> {
        self.members().iter().find(|(k, _)| k == key).map(|(_, v)| v)
    }

    /// The members of an object in file order; empty for anything else.
    pub(super) fn members(&self) -> &[(Cow<'a, str>, Json<'a>)] {
        if let Json::Object(members) = self { members } else { &[] }
    }

    /// The elements of an array; empty for anything else.
    pub(super) fn elements(&self) -> &[Json<'a>] {
        if let Json::Array(elements) = self { elements } else { &[] }
    }

    /// The elements of the array of that name.
    pub(super) fn list(&self, key: &str) -> &[Json<'a>] {
        self.at(key).elements()
    }

    /// An extension object of this value.
    pub(super) fn extension(&self, name: &str) -> Option<&Json<'a>> {
        self.at("extensions").get(name)
    }

    /// The number, if this is one.
    pub(super) fn number(&self) -> Option<f64> {
        if let Json::Number(x) = self { Some(*x) } else { None }
    }

    /// The number as a count or an index, if it is a whole number that fits.
    pub(super) fn integer(&self) -> Option<usize> {
        self.number().filter(|x| *x >= 0.0 && *x <= 9e15 && x.fract() == 0.0).map(|x| x as usize)
    }

    /// The text, if this is a string.
    pub(super) fn text(&self) -> Option<&str> {
        if let Json::String(text) = self { Some(text) } else { None }
    }

    /// An index or count of that name.
    pub(super) fn index(&self, key: &str) -> Option<usize> {
        self.at(key).integer()
    }

    /// The number of that name.
    pub(super) fn float(&self, key: &str, default: f32) -> f32 {
        self.at(key).number().map_or(default, |x| x as f32)
    }

    /// The flag of that name; false if there is none.
    pub(super) fn flag(&self, key: &str) -> bool {
        matches!(self.at(key), Json::Bool(true))
    }

    /// The array of `N` numbers of that name.
    pub(super) fn floats<const N: usize>(&self, key: &str) -> Option<[f32; N]> {
        self.doubles(key).map(|values: [f64; N]| values.map(|x| x as f32))
    }

    /// The array of `N` numbers of that name, in double precision.
    pub(super) fn doubles<const N: usize>(&self, key: &str) -> Option<[f64; N]> {
        let elements = self.list(key);
        let mut values = [0.0; N];
        if elements.len() != N {
            return None;
        }
        for (value, element) in values.iter_mut().zip(elements) {
            *value = element.number()?;
        }
        Some(values)
    }
}

/// Counts values while the tree grows.
#[derive(Clone, Copy)]
struct Seed<'c> {
    values: &'c Cell<usize>,
}

impl<'de> DeserializeSeed<'de> for Seed<'_> {
    type Value = Json<'de>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Json<'de>, D::Error> {
        self.values.set(self.values.get() + 1);
        if self.values.get() > MAX_VALUES {
            return Err(de::Error::custom("the document holds too many values"));
        }
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Seed<'_> {
    type Value = Json<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Json<'de>, E> {
        Ok(Json::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Json<'de>, E> {
        Ok(Json::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Json<'de>, E> {
        Ok(Json::Number(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Json<'de>, E> {
        Ok(Json::Number(value as f64))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Json<'de>, E> {
        Ok(Json::Number(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Json<'de>, E> {
        Ok(Json::String(Cow::Owned(value.to_owned())))
    }

    fn visit_borrowed_str<E>(self, value: &'de str) -> Result<Json<'de>, E> {
        Ok(Json::String(Cow::Borrowed(value)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Json<'de>, A::Error> {
        let mut elements = Vec::new();
        while let Some(element) = seq.next_element_seed(self)? {
            elements.push(element);
        }
        elements.shrink_to_fit();
        Ok(Json::Array(elements))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Json<'de>, A::Error> {
        let mut members: Vec<(Cow<'de, str>, Json<'de>)> = Vec::new();
        while let Some(Key(key)) = map.next_key()? {
            members.push((key, map.next_value_seed(self)?));
        }
        match double_key(&members) {
            Some(key) => Err(de::Error::custom(format_args!("the key \"{key}\" stands twice in one object"))),
            None => Ok(Json::Object(members)),
        }
    }
}

/// A key that stands twice.
fn double_key<'m>(members: &'m [(Cow<'_, str>, Json<'_>)]) -> Option<&'m str> {
    let mut keys: Vec<&str> = members.iter().map(|(key, _)| key.as_ref()).collect();
    keys.sort_unstable();
    keys.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0])
}

/// An object's key, borrowed where it has no escapes.
struct Key<'a>(Cow<'a, str>);

impl<'de> Deserialize<'de> for Key<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct KeyVisitor;
        impl<'de> Visitor<'de> for KeyVisitor {
            type Value = Key<'de>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a key")
            }
            fn visit_str<E>(self, value: &str) -> Result<Key<'de>, E> {
                Ok(Key(Cow::Owned(value.to_owned())))
            }
            fn visit_borrowed_str<E>(self, value: &'de str) -> Result<Key<'de>, E> {
                Ok(Key(Cow::Borrowed(value)))
            }
        }
        deserializer.deserialize_str(KeyVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_and_missing_ones_are_null() {
        let json = parse(br#"{"a":[1,2.5],"b":{"c":"x\n"},"n":1e0,"t":true,"z":null}"#).expect("valid");
        assert_eq!(json.floats("a"), Some([1.0, 2.5]));
        assert_eq!(json.floats::<3>("a"), None);
        assert_eq!(json.at("b").at("c").text(), Some("x\n"));
        assert_eq!(json.index("n"), Some(1));
        assert!(json.flag("t"));
        assert_eq!(json.at("z"), json.at("missing"));
    }

    #[test]
    fn broken_documents_are_errors_with_a_place() {
        for (bytes, words) in [
            (&b"{\"a\":1,\"a\":2}"[..], "stands twice"),
            (b"{\"a\":1e999}", "out of range"),
            (b"{} x", "trailing"),
            (b"", "EOF"),
            (b"\"\xff\"", "unicode"),
        ] {
            let error = parse(bytes).expect_err("broken").to_string();
            assert!(error.contains(words) && error.contains("line"), "{error}");
        }
        assert!(parse("[".repeat(10_000).as_bytes()).is_err(), "depth is bounded");
    }
}
