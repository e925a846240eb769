//! Who may come in: requests with the token, for this machine's name, from this page.

use std::net::IpAddr;

/// A random token for addresses: 128 bits in hexadecimal digits.
pub(crate) fn new_token() -> Result<String, getrandom::Error> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// What is compared with requests.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    pub(crate) token: String,
    /// The address on which the server listens.
    pub(crate) address: IpAddr,
}

impl Guard {
    /// Whether a token is the right one, in a time that does not tell how much of it is.
    pub(crate) fn knows_token(&self, token: &str) -> bool {
        let (given, right) = (token.as_bytes(), self.token.as_bytes());
        given.len() == right.len() && given.iter().zip(right).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
    }

    /// Whether a request is for this server by its name, whatever the port (tunnels have others), and comes from no foreign page.
    /// Names that anybody could point at this machine are refused.
    pub(crate) fn accepts(&self, host: Option<&str>, origin: Option<&str>) -> bool {
        let Some(host) = host else { return false };
        let is_ours = match name_of(host) {
            "localhost" => true,
            name => name.parse().is_ok_and(|ip: IpAddr| {
                ip.is_loopback() || ip == self.address || self.address.is_unspecified()
            }),
        };
        let same =
            |origin: &str| origin.strip_prefix("http://").or(origin.strip_prefix("https://")) == Some(host);
        is_ours && origin.is_none_or(same)
    }
}

/// The name of `name:port`, `[v6]:port` or `name`.
fn name_of(host: &str) -> &str {
    match host.strip_prefix('[') {
        Some(v6) => v6.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(address: &str) -> Guard {
        Guard { token: "0123abcd".into(), address: address.parse().expect("an address") }
    }

    #[test]
    fn tokens_are_random_and_compared_whole() {
        let tokens = [new_token(), new_token()].map(|t| t.expect("random bytes"));
        assert!(tokens[0] != tokens[1] && tokens[0].len() == 32);
        let guard = guard("127.0.0.1");
        assert!(guard.knows_token("0123abcd"));
        for wrong in ["", "0123abc", "0123abce", "0123abcd0", "0123ABCD"] {
            assert!(!guard.knows_token(wrong), "{wrong}");
        }
    }

    #[test]
    fn foreign_hosts_and_origins_stay_outside() {
        let local = guard("127.0.0.1");
        for host in ["127.0.0.1:8123", "localhost:9", "[::1]:80", "localhost"] {
            assert!(local.accepts(Some(host), None), "{host}");
            assert!(local.accepts(Some(host), Some(&format!("http://{host}"))));
        }
        for host in ["evil.example:8123", "10.0.0.7:8123", "127.0.0.1.evil.example", ""] {
            assert!(!local.accepts(Some(host), None), "{host}");
        }
        assert!(!local.accepts(None, None));
        for origin in ["http://evil.example", "null", "http://127.0.0.1:9999", "file://", ""] {
            assert!(!local.accepts(Some("127.0.0.1:8123"), Some(origin)), "{origin}");
        }
        assert!(guard("10.0.0.7").accepts(Some("10.0.0.7:80"), None));
        assert!(guard("0.0.0.0").accepts(Some("10.0.0.7:80"), None));
        assert!(!guard("0.0.0.0").accepts(Some("rebound.example:80"), None));
    }
}
