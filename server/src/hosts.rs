//! The host names under which the server may be addressed.

use std::collections::BTreeSet;
use std::sync::Arc;

/// The host names under which the server may be addressed.
#[derive(Clone, Debug)]
pub struct Hosts {
    names: Arc<BTreeSet<String>>,
    port: u16,
}

impl Hosts {
    /// The names of the loopback interface with `port`, and `others`, each with or without its own port.
    pub fn new(port: u16, others: &[String]) -> Self {
        let own = ["localhost", "127.0.0.1", "[::1]"];
        let others: Vec<_> = others.iter().map(|host| host.to_ascii_lowercase()).collect();
        let named = own.into_iter().chain(others.iter().map(String::as_str));
        let mut hosts: BTreeSet<_> = named.map(|host| format!("{host}:{port}")).collect();
        if port == 80 {
            // Browsers omit the default port of the scheme.
            hosts.extend(own.map(str::to_owned));
        }
        hosts.extend(others);
        Self { names: Arc::new(hosts), port }
    }

    /// The same names and `host`, which includes its port.
    pub(crate) fn and(&self, host: &str) -> Self {
        let mut names = BTreeSet::clone(&self.names);
        names.insert(host.to_ascii_lowercase());
        Self { names: Arc::new(names), port: self.port }
    }

    pub(crate) fn has(&self, host: &str) -> bool {
        self.names.contains(&host.to_ascii_lowercase())
    }

    /// The port on which the server listens.
    pub(crate) const fn port(&self) -> u16 {
        self.port
    }
}
