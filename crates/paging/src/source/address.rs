//! Addresses of sources on servers, and what messages may show of them.

use std::borrow::Cow;

/// What the address of a source on a server begins with.
const SCHEMES: [&str; 3] = ["https://", "http://", "s3://"];

/// Whether a name is the address of a source on a server, not a path.
#[must_use]
pub fn is_address(name: &str) -> bool {
    SCHEMES.iter().any(|scheme| name.starts_with(scheme))
}

/// A name for messages: an address without its user, its password and its query, which may be a signature; a path as it is.
#[must_use]
pub fn shown(name: &str) -> Cow<'_, str> {
    let Some((scheme, rest)) = name.split_once("://") else { return name.into() };
    let rest = rest.split(['?', '#']).next().unwrap_or_default();
    let host_end = rest.find('/').unwrap_or(rest.len());
    let host = rest[..host_end].rfind('@').map_or(0, |at| at + 1);
    format!("{scheme}://{}", &rest[host..]).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_of_addresses_are_not_shown() {
        for (name, expected) in [
            ("https://host/a.vls?signature=1", "https://host/a.vls"),
            ("http://user:p@ss@host:80/a@b.vls#c", "http://host:80/a@b.vls"),
            ("s3://bucket/a.vls", "s3://bucket/a.vls"),
            ("https://user:pass@host", "https://host"),
            ("a folder/what?.vls", "a folder/what?.vls"),
            ("ftp://user@host/a", "ftp://host/a"),
        ] {
            assert_eq!(shown(name), expected);
            assert_eq!(is_address(name), name.starts_with("http") || name.starts_with("s3"));
        }
    }
}
