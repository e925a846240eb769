//! A small schema language for JSON documents, and the walk that checks a document against it.

use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use std::fmt::Write;

/// What a value must be.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Bool,
    Text,
    /// A text of a list; another one is only a warning, since later versions may add words.
    Words(&'static [&'static str]),
    /// A whole number within bounds (inclusive).
    Whole(u64, u64),
    /// A whole number of a list; another one is only a warning.
    Codes(&'static [u32]),
    Number(Range),
    /// A list of numbers with a length within bounds (inclusive).
    Numbers(usize, usize, Range),
    /// A whole number that is an index into a table of the document.
    Reference(Table),
    /// A list of distinct indices.
    References(Table),
    /// A list of distinct texts.
    Texts,
    Object(&'static Object),
    Objects(&'static Object),
    /// An object with any keys, all values of one kind.
    Map(&'static Kind),
    /// A list of such objects.
    Maps(&'static Kind),
}

/// Bounds of a number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Range {
    Any,
    /// At least.
    Min(f64),
    /// More than.
    Above(f64),
    /// From, to, both inclusive.
    Within(f64, f64),
}

impl Range {
    fn holds(self, x: f64) -> bool {
        match self {
            Self::Any => x.is_finite(),
            Self::Min(min) => x.is_finite() && x >= min,
            Self::Above(min) => x.is_finite() && x > min,
            Self::Within(min, max) => (min..=max).contains(&x),
        }
    }
}

/// A table that indices point into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Table {
    /// A list at the document's root.
    Root(&'static str),
    /// The lights of KHR_lights_punctual.
    Lights,
    /// A list within the object that holds the list of the referring object: checked elsewhere.
    Local,
}

/// A property of an object.
#[derive(Clone, Copy, Debug)]
pub(super) struct Property {
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    pub(super) required: bool,
    /// Another property that must be there too; empty for none.
    pub(super) needs: &'static str,
}

/// A property that may be absent.
pub(super) const fn opt(name: &'static str, kind: Kind) -> Property {
    Property { name, kind, required: false, needs: "" }
}

/// A property that must be there.
pub(super) const fn req(name: &'static str, kind: Kind) -> Property {
    Property { name, kind, required: true, needs: "" }
}

impl Property {
    /// The property needs another one.
    pub(super) const fn needs(mut self, other: &'static str) -> Self {
        self.needs = other;
        self
    }
}

/// An object: its properties, and the extensions that vastlight knows at it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Object {
    pub(super) properties: &'static [Property],
    pub(super) extensions: &'static [(&'static str, &'static Object)],
}

/// An object without extensions of its own.
pub(super) const fn object(properties: &'static [Property]) -> Object {
    Object { properties, extensions: &[] }
}

/// An object with extensions.
pub(super) const fn extended(
    properties: &'static [Property],
    extensions: &'static [(&'static str, &'static Object)],
) -> Object {
    Object { properties, extensions }
}

/// Checks a document.
pub(super) fn check(root: &Json<'_>, schema: &'static Object, findings: &mut Findings) {
    let declared = root.list("extensionsUsed").iter().filter_map(Json::text).collect();
    Walker { root, declared, path: Vec::new(), findings }.object(root, schema);
}

/// The length of a table.
pub(super) fn table_length(root: &Json<'_>, table: Table) -> Option<usize> {
    match table {
        Table::Root(name) => Some(root.list(name).len()),
        Table::Lights => Some(root.extension("KHR_lights_punctual").map_or(0, |e| e.list("lights").len())),
        Table::Local => None,
    }
}

#[derive(Clone, Copy)]
enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

struct Walker<'a> {
    root: &'a Json<'a>,
    declared: Vec<&'a str>,
    path: Vec<Step<'a>>,
    findings: &'a mut Findings,
}

impl<'a> Walker<'a> {
    fn place(&self) -> String {
        let mut place = String::new();
        for step in &self.path {
            match step {
                Step::Key(key) => push_key(&mut place, key),
                // Writing to a string cannot fail.
                Step::Index(i) => drop(write!(place, "/{i}")),
            }
        }
        if place.is_empty() { "/".into() } else { place }
    }

    fn error(&mut self, code: &'static str, what: impl Into<String>) {
        let place = self.place();
        self.findings.error(code, what, &place, "");
    }

    fn within(&mut self, step: Step<'a>, check: impl FnOnce(&mut Self)) {
        self.path.push(step);
        check(self);
        self.path.pop();
    }

    fn object(&mut self, json: &'a Json<'a>, schema: &'static Object) {
        let Json::Object(members) = json else {
            return self.mismatch(json, "an object");
        };
        for (key, value) in members {
            self.within(Step::Key(key), |walker| walker.member(key, value, schema));
        }
        for property in schema.properties {
            let found = json.get(property.name).is_some();
            if property.required && !found {
                self.error("UNDEFINED_PROPERTY", format!("the property \"{}\" is missing", property.name));
            }
            if found && !property.needs.is_empty() && json.get(property.needs).is_none() {
                let what = format!("this needs the property \"{}\" as well", property.needs);
                self.within(Step::Key(property.name), |walker| walker.error("UNSATISFIED_DEPENDENCY", what));
            }
        }
    }

    fn member(&mut self, key: &'a str, value: &'a Json<'a>, schema: &'static Object) {
        match key {
            "extras" => {}
            "extensions" => self.extensions(value, schema),
            _ => match schema.properties.iter().find(|p| p.name == key) {
                Some(property) => self.value(value, property.kind),
                None => {
                    let place = self.place();
                    self.findings.warn(
                        "UNEXPECTED_PROPERTY",
                        "the property is unknown",
                        &place,
                        "it is ignored",
                    );
                }
            },
        }
    }

    fn extensions(&mut self, json: &'a Json<'a>, schema: &'static Object) {
        let Json::Object(members) = json else {
            return self.mismatch(json, "an object");
        };
        for (name, value) in members {
            self.within(Step::Key(name), |walker| {
                if !walker.declared.contains(&name.as_ref()) {
                    walker.error("UNDECLARED_EXTENSION", "the extension is not declared in extensionsUsed");
                }
                match schema.extensions.iter().find(|(known, _)| known == name) {
                    Some((_, extension)) => walker.object(value, extension),
                    None if !matches!(value, Json::Object(_)) => walker.mismatch(value, "an object"),
                    None => {}
                }
            });
        }
    }

    fn value(&mut self, json: &'a Json<'a>, kind: Kind) {
        match kind {
            Kind::Bool if matches!(json, Json::Bool(_)) => {}
            Kind::Bool => self.mismatch(json, "a boolean"),
            Kind::Text | Kind::Words(_) => self.text(json, kind),
            Kind::Whole(..) | Kind::Codes(_) | Kind::Reference(_) => self.whole(json, kind),
            Kind::Number(range) => self.number(json, range),
            Kind::Numbers(min, max, range) => {
                self.list(json, |walker, element| walker.number(element, range));
                self.length(json, min, max);
            }
            Kind::References(_) | Kind::Texts => self.distinct(json, kind),
            Kind::Object(schema) => self.object(json, schema),
            Kind::Objects(schema) => self.list(json, |walker, element| walker.object(element, schema)),
            Kind::Map(kind) => self.map(json, *kind),
            Kind::Maps(kind) => self.list(json, |walker, element| walker.map(element, *kind)),
        }
    }

    fn text(&mut self, json: &'a Json<'a>, kind: Kind) {
        match (json.text(), kind) {
            (None, _) => self.mismatch(json, "a string"),
            (Some(text), Kind::Words(words)) if !words.contains(&text) => {
                let what =
                    format!("\"{}\" is none of {}", crate::gltf::buffers::shorten(text), words.join(", "));
                self.unknown(&what);
            }
            _ => {}
        }
    }

    fn whole(&mut self, json: &'a Json<'a>, kind: Kind) {
        let Some(number) = json.number() else {
            return self.mismatch(json, "a number");
        };
        let Some(value) = json.integer() else {
            if number < 0.0 && number.fract() == 0.0 {
                return self.error("VALUE_NOT_IN_RANGE", format!("{number} is out of range"));
            }
            return self.mismatch(json, "a whole number");
        };
        match kind {
            Kind::Whole(min, max) if !(min..=max).contains(&(value as u64)) => {
                self.error("VALUE_NOT_IN_RANGE", format!("{value} is out of range"));
            }
            Kind::Codes(codes) if !codes.iter().any(|&code| code as usize == value) => {
                self.unknown(&format!("{value} is none of {codes:?}"));
            }
            Kind::Reference(table) => self.reference(value, table),
            _ => {}
        }
    }

    fn reference(&mut self, index: usize, table: Table) {
        if table_length(self.root, table).is_some_and(|length| index >= length) {
            self.error("UNRESOLVED_REFERENCE", format!("{index} refers to nothing"));
        }
    }

    fn unknown(&mut self, what: &str) {
        let place = self.place();
        self.findings.warn("VALUE_NOT_IN_LIST", what, &place, "it is ignored");
    }

    fn number(&mut self, json: &'a Json<'a>, range: Range) {
        match json.number() {
            None => self.mismatch(json, "a number"),
            Some(x) if !range.holds(x) => self.error("VALUE_NOT_IN_RANGE", format!("{x} is out of range")),
            Some(_) => {}
        }
    }

    /// A list with at least one element, each checked.
    fn list(&mut self, json: &'a Json<'a>, check: impl Fn(&mut Self, &'a Json<'a>)) {
        let Json::Array(elements) = json else {
            return self.mismatch(json, "an array");
        };
        if elements.is_empty() {
            self.error("EMPTY_ENTITY", "the array is empty");
        }
        for (i, element) in elements.iter().enumerate() {
            self.within(Step::Index(i), |walker| check(walker, element));
        }
    }

    fn length(&mut self, json: &'a Json<'a>, min: usize, max: usize) {
        let length = json.elements().len();
        if length != 0 && !(min..=max).contains(&length) {
            let wanted = if min == max { min.to_string() } else { format!("{min} to {max}") };
            self.error("ARRAY_LENGTH_NOT_IN_LIST", format!("the array has {length} elements, not {wanted}"));
        }
    }

    fn distinct(&mut self, json: &'a Json<'a>, kind: Kind) {
        match kind {
            Kind::References(table) => self.list(json, |w, element| w.whole(element, Kind::Reference(table))),
            _ => self.list(json, |w, element| w.text(element, Kind::Text)),
        }
        for i in repeated(json.elements()) {
            self.within(Step::Index(i), |walker| {
                walker.error("DUPLICATE_ELEMENTS", "the element stands here twice")
            });
        }
    }

    fn map(&mut self, json: &'a Json<'a>, kind: Kind) {
        let Json::Object(members) = json else {
            return self.mismatch(json, "an object");
        };
        if members.is_empty() {
            self.error("EMPTY_ENTITY", "the object is empty");
        }
        for (key, value) in members {
            self.within(Step::Key(key), |walker| walker.value(value, kind));
        }
    }

    fn mismatch(&mut self, json: &Json<'_>, wanted: &str) {
        let found = match json {
            Json::Null => "null",
            Json::Bool(_) => "a boolean",
            Json::Number(_) => "a number",
            Json::String(_) => "a string",
            Json::Array(_) => "an array",
            Json::Object(_) => "an object",
        };
        let what = if found == wanted {
            "the value is of a wrong type".into()
        } else {
            format!("this is {found}, not {wanted}")
        };
        self.error("TYPE_MISMATCH", what);
    }
}

/// Appends a key to a JSON pointer (RFC 6901).
fn push_key(place: &mut String, key: &str) {
    place.push('/');
    place.push_str(&key.replace('~', "~0").replace('/', "~1"));
}

/// A JSON pointer to a member.
pub(super) fn pointer(parent: &str, key: &str) -> String {
    let mut place = parent.to_owned();
    push_key(&mut place, key);
    place
}

/// Positions of elements that stand further ahead already.
fn repeated(elements: &[Json<'_>]) -> Vec<usize> {
    let key = |json: &Json<'_>| match json {
        Json::Number(x) => Some((x.to_bits(), String::new())),
        Json::String(text) => Some((0, text.to_string())),
        _ => None,
    };
    let mut keys: Vec<_> = elements.iter().enumerate().filter_map(|(i, e)| Some((key(e)?, i))).collect();
    keys.sort();
    let mut again: Vec<usize> = keys.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1).collect();
    again.sort_unstable();
    again
}
