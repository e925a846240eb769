//! References to other data: `data:` URIs and relative file names.

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::path::{Path, PathBuf};

/// What a URI refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Uri<'a> {
    /// Data within the URI: media type and the bytes.
    Data {
        /// Without parameters, in the file's spelling; may be empty.
        media_type: &'a str,
        /// Decoded bytes.
        bytes: Vec<u8>,
    },
    /// A file beside the document, its name decoded.
    File(PathBuf),
    /// Something that is no file beside the document.
    Remote,
    /// Nothing that can be understood, and why.
    Invalid(&'static str),
}

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Understands a URI; relative names are resolved against `directory`.
pub(super) fn resolve<'a>(uri: &'a str, directory: &Path) -> Uri<'a> {
    if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        return decode_data(&uri[5..]);
    }
    match scheme(uri) {
        Scheme::Broken => Uri::Invalid("the scheme is not well-formed"),
        Scheme::Some => Uri::Remote,
        Scheme::None => resolve_file(uri, directory),
    }
}

/// `[mediatype][;base64],data`
fn decode_data(rest: &str) -> Uri<'_> {
    let Some((head, body)) = rest.split_once(',') else {
        return Uri::Invalid("the data URI has no comma");
    };
    let mut parts = head.split(';');
    let media_type = parts.next().unwrap_or("");
    let parameters: Vec<&str> = parts.collect();
    let is_base64 = parameters.last().is_some_and(|last| last.eq_ignore_ascii_case("base64"));
    let named = &parameters[..parameters.len() - usize::from(is_base64)];
    if named.iter().any(|parameter| !parameter.contains('=')) {
        return Uri::Invalid("a parameter of the data URI has no value");
    }
    if !is_base64 {
        return Uri::Data { media_type, bytes: percent_decode_str(body).collect() };
    }
    let decoded = if body.contains('%') {
        BASE64.decode(percent_decode_str(body).collect::<Vec<u8>>())
    } else {
        BASE64.decode(body)
    };
    match decoded {
        Ok(bytes) => Uri::Data { media_type, bytes },
        Err(_) => Uri::Invalid("the data URI is no valid base64"),
    }
}

enum Scheme {
    None,
    Some,
    Broken,
}

/// What stands before the first colon, unless a path, query or fragment begins earlier.
fn scheme(uri: &str) -> Scheme {
    let Some(end) = uri.find([':', '/', '?', '#']) else {
        return Scheme::None;
    };
    if uri.as_bytes()[end] != b':' {
        return Scheme::None;
    }
    let name = &uri[..end];
    let starts_with_letter = name.starts_with(|c: char| c.is_ascii_alphabetic());
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.');
    if starts_with_letter && name.chars().all(allowed) { Scheme::Some } else { Scheme::Broken }
}

fn resolve_file<'a>(uri: &'a str, directory: &Path) -> Uri<'a> {
    if uri.starts_with('/') {
        return Uri::Remote;
    }
    let end = uri.find(['?', '#']).unwrap_or(uri.len());
    match percent_decode_str(&uri[..end]).decode_utf8() {
        Ok(name) if name.is_empty() => Uri::Invalid("the URI is empty"),
        Ok(name) if name.contains('\0') => Uri::Invalid("the URI holds a zero byte"),
        Ok(name) => Uri::File(directory.join(name.as_ref())),
        Err(_) => Uri::Invalid("the URI is no valid UTF-8"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(uri: &str) -> Uri<'_> {
        resolve(uri, Path::new("dir"))
    }

    #[test]
    fn data_uris_are_decoded() {
        let bytes = b"ab?".to_vec();
        for uri in
            ["data:application/x;base64,YWI/", "DATA:application/x;base64,YWI%2F", "data:application/x,ab?"]
        {
            assert_eq!(parse(uri), Uri::Data { media_type: "application/x", bytes: bytes.clone() }, "{uri}");
        }
        assert_eq!(parse("data:;base64,YQ"), Uri::Data { media_type: "", bytes: b"a".to_vec() });
        assert!(matches!(parse("data:"), Uri::Invalid(_)));
        assert!(matches!(parse("data:x;;base64,YQ"), Uri::Invalid(_)));
        assert!(matches!(parse("data:x;base64,?"), Uri::Invalid(_)));
    }

    #[test]
    fn file_names_are_percent_decoded_and_other_schemes_are_not_files() {
        assert_eq!(parse("Box%20With Spaces.bin?x#y"), Uri::File("dir/Box With Spaces.bin".into()));
        assert_eq!(parse("a/b:c.bin"), Uri::File("dir/a/b:c.bin".into()));
        assert_eq!(parse("http://a/b"), Uri::Remote);
        assert_eq!(parse("//a/b"), Uri::Remote);
        assert!(matches!(parse("1:b"), Uri::Invalid(_)));
        assert!(matches!(parse("%ff"), Uri::Invalid(_)));
        assert!(matches!(parse(""), Uri::Invalid(_)));
    }
}
