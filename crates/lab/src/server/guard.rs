//! Who gets an answer: pages of this very lab, opened by whoever has its address.

use super::http::Request;

/// Requirements of a request.
pub(super) struct Guard {
    pub port: u16,
    pub token: String,
}

impl Guard {
    /// Returns the path behind the token, without its query.
    ///
    /// # Errors
    /// Another host (a name of somebody else's that leads here), another origin, no token: why, in words.
    pub fn path(&self, request: &Request) -> Result<String, &'static str> {
        let header = |name: &str| request.header(name);
        self.check(header("Host"), header("Origin"), header("Sec-Fetch-Site"), &request.target)
    }

    fn check(
        &self,
        host: Option<&str>,
        origin: Option<&str>,
        site: Option<&str>,
        url: &str,
    ) -> Result<String, &'static str> {
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let host = host.unwrap_or_default();
        // Clients leave out the port that is usual.
        let bare = self.port == 80 && ["127.0.0.1", "localhost"].contains(&host);
        if !bare && !hosts.iter().any(|known| known == host) {
            return Err("the request is for another host");
        }
        if origin.is_some_and(|origin| origin.strip_prefix("http://") != Some(host)) {
            return Err("the request comes from another page");
        }
        if site.is_some_and(|site| !["same-origin", "none"].contains(&site)) {
            return Err("the request comes from another page");
        }
        let path = url.split(['?', '#']).next().unwrap_or_default();
        let (token, path) = path.strip_prefix('/').and_then(|path| path.split_once('/')).unwrap_or_default();
        if !same(token.as_bytes(), self.token.as_bytes()) {
            return Err("the address lacks the lab's token: open the one that `standstill lab` printed");
        }
        Ok(path.to_owned())
    }
}

/// Returns true for equal texts. The time does not depend on where they differ.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |different, (a, b)| different | (a ^ b)) == 0
}

/// Returns a path without its `%20`s.
pub(super) fn decoded(path: &str) -> String {
    let mut parts = path.split('%');
    let mut out = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let escaped = part.get(..2).and_then(|digits| u8::from_str_radix(digits, 16).ok());
        let (byte, rest) = escaped.map_or((b'%', part), |byte| (byte, &part[2..]));
        out.push(byte);
        out.extend_from_slice(rest.as_bytes());
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// promise: lab-answers-its-page-alone
    #[test]
    fn law_only_pages_of_the_lab_with_its_token_get_an_answer() {
        let guard = Guard { port: 8123, token: "abc".to_owned() };
        let own = Some("127.0.0.1:8123");
        let check = |host, origin, site, url| guard.check(host, origin, site, url).ok();
        assert_eq!(check(own, None, None, "/abc/"), Some(String::new()));
        assert_eq!(check(own, None, Some("none"), "/abc/api/start?x=1"), Some("api/start".to_owned()));
        assert_eq!(
            check(Some("localhost:8123"), Some("http://localhost:8123"), None, "/abc/x"),
            Some("x".to_owned())
        );
        for (host, origin, site, url) in [
            (None, None, None, "/abc/"),
            (Some("evil.example"), None, None, "/abc/"),
            (Some("127.0.0.1"), None, None, "/abc/"),
            (Some("127.0.0.1:8124"), None, None, "/abc/"),
            (Some("evil.example:8123"), None, None, "/abc/"),
            (own, Some("http://evil.example"), None, "/abc/"),
            (own, Some("null"), None, "/abc/"),
            (own, Some("https://127.0.0.1:8123"), None, "/abc/"),
            (own, Some("http://localhost:8123"), None, "/abc/"),
            (own, None, Some("cross-site"), "/abc/"),
            (own, None, Some("same-site"), "/abc/"),
            (own, None, None, "/"),
            (own, None, None, "/abd/"),
            (own, None, None, "/ab/"),
            (own, None, None, "/abc"),
            (own, None, None, "abc/"),
            (own, None, None, "/x/../abc/"),
        ] {
            assert_eq!(check(host, origin, site, url), None, "{host:?} {origin:?} {site:?} {url}");
        }
    }

    #[test]
    fn analytic_paths_are_decoded() {
        for (path, expected) in [
            ("a%20b/c", "a b/c"),
            ("%2e%2E/x", "../x"),
            ("100%", "100%"),
            ("%zz%4", "%zz%4"),
            ("%c3%bc", "ü"),
        ] {
            assert_eq!(decoded(path), expected);
        }
    }
}
